"""Experiments of `simscen bench nav`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from simscen.bench.navigation import barn, dynamic_fields, experiments, office_maps, random_goals
from simscen.bench.navigation.experiments import Experiment
from simscen.bench.navigation.office_maps import write_building

if TYPE_CHECKING:
    from simscen.core.environment.world_model import BuiltWorld

SHIPPED = ("house", "office", "warehouse")
BARN = "--barn names a folder with its worlds: https://www.cs.utexas.edu/~xiao/BARN/BARN.html"
NAV2 = "--nav2 names a folder with it: https://github.com/ros-navigation/nav2_minimal_turtlebot_simulation"
LIDAR_HEIGHT = 0.2
"""Height in meters of the lidar for which the maps of worlds are made."""


@dataclass(frozen=True)
class Sizes:
    """Size of the experiments, and the `first` number of their fields, buildings, drives, and seeds.

    `seeds` is None for the usual number of each experiment.
    """

    first: int = 1
    seeds: int | None = None
    fields: int = 50
    dynamic: int = 20
    goals: int = 20
    lost: int = 50

    def seeded(self, usual: int) -> Sequence[int]:
        """Return the seeds of a scenario that usually runs with `usual` seeds."""
        return self.numbers(self.seeds or usual)

    def numbers(self, count: int) -> Sequence[int]:
        """Return `count` numbers starting at `first`."""
        return range(self.first, self.first + count)


@dataclass(frozen=True)
class AvailableExperiment:
    """Group of experiments, the folder that it needs, and the function that creates it.

    `parts` are the names of its experiments with other names than the group; creating them all may take a while.
    Without a folder, `source` names the option for it and the origin of its data.
    """

    name: str
    needs: Path | None
    make: Callable[[], Sequence[Experiment]]
    source: str = ""
    parts: Sequence[str] = ()

    @property
    def missing(self) -> str:
        """Reason why the group cannot run, or ""."""
        if self.needs is None:
            return self.source
        return "" if self.needs.is_dir() else f"there is no folder {self.needs}"


def available_experiments(
    data: Path | None, nav2: Path | None, project: Path, made: Path, sizes: Sizes
) -> list[AvailableExperiment]:
    """Return all groups of experiments in the order of the table; generated files are written to `made`."""
    worlds, scenarios = project / "worlds", project / "scenarios"
    return [
        replace(offer, parts=_parts(offer.name, scenarios))
        for offer in _offers(data, nav2, worlds, scenarios, made, sizes)
    ]


def _parts(name: str, scenarios: Path) -> list[str]:
    """Return the names of the experiments of a group that differ from its name."""
    match name:
        case "BARN":
            return [f"BARN, {variant}" for variant in ("default parameters", *barn.CONTROLLERS)]
        case "narrow fields":
            return [experiments.narrow_name(room) for room in experiments.NARROW_MARGINS_M]
        case "dynamic fields":
            return [experiments.dynamic_name(speed) for speed in dynamic_fields.SPEEDS_M_S]
        case "random goals":
            return ["random goals, ROS maps"]
        case "degraded sensing":
            return [f"degraded sensing, {strength}" for strength in random_goals.STRENGTHS]
        case "two robots":
            return ["two robots in a corridor"]
        case "tb3_sandbox":
            return ["tb3_sandbox, unmapped box"]
        case "corner cases":
            return [experiments.case_name(file) for file in experiments.case_files(scenarios)]
        case "localization":
            return [f"localization, {name}" for name in experiments.LOCALIZATIONS]
        case _:
            return []


def _offers(
    data: Path | None, nav2: Path | None, worlds: Path, scenarios: Path, made: Path, sizes: Sizes
) -> list[AvailableExperiment]:
    return [
        AvailableExperiment("BARN", data, lambda: list(_barn(made, data or Path(), sizes)), BARN),
        AvailableExperiment(
            "generated fields", made, lambda: [experiments.generated_fields(made, sizes.numbers(sizes.fields))]
        ),
        AvailableExperiment(
            "narrow fields", made, lambda: experiments.narrow_fields(made, sizes.numbers(sizes.fields // 2))
        ),
        AvailableExperiment(
            "dynamic fields", made, lambda: experiments.dynamic_fields(made, sizes.numbers(sizes.dynamic))
        ),
        AvailableExperiment("random goals", worlds, lambda: list(_random_goals(made, worlds, sizes))),
        AvailableExperiment("degraded sensing", worlds, lambda: _degraded(made, worlds, sizes)),
        AvailableExperiment("ramps", made, lambda: [office_maps.ramps(made / "ramps", sizes.numbers(sizes.goals))]),
        AvailableExperiment(
            "two robots", made, lambda: [office_maps.two_robots(made / "corridors", sizes.numbers(sizes.goals))]
        ),
        AvailableExperiment(
            "tb3_sandbox", nav2, lambda: experiments.sandbox(made, nav2 or Path(), sizes.seeded(20)), NAV2
        ),
        AvailableExperiment(
            "corner cases", scenarios, lambda: experiments.corner_cases(scenarios, scenarios.parent, sizes.seeded(20))
        ),
        AvailableExperiment(
            "localization",
            worlds,
            lambda: experiments.localization_experiments(made, worlds, sizes.seeded(20), sizes.numbers(sizes.lost)),
        ),
    ]


def _barn(made: Path, data: Path, sizes: Sizes) -> Iterator[Experiment]:
    """Yield the BARN challenge at 2 m/s, with default parameters, and with each controller at the same speed."""
    seeds = sizes.seeded(5)
    yield experiments.barn_challenge(made, data, seeds)
    yield experiments.barn_challenge(made, data, seeds, "default parameters", barn.DEFAULT)
    for controller, stack in barn.CONTROLLERS.items():
        yield experiments.barn_challenge(made, data, seeds, controller, stack)


def _random_goals(made: Path, worlds: Path, sizes: Sizes) -> Iterator[Experiment]:
    folder, maps = made / "random_goals", made / "buildings"
    yield random_goals.random_goals(
        "random goals", folder, _shipped(folder, worlds), sizes.numbers(sizes.goals), (worlds.absolute(),)
    )
    buildings = _buildings(maps, sizes.numbers(sizes.goals))
    yield random_goals.random_goals("random goals, ROS maps", maps, buildings, range(1, 4))


def _degraded(made: Path, worlds: Path, sizes: Sizes) -> list[Experiment]:
    """Return the experiments in shipped worlds and generated buildings, a quarter as many worlds as `goals`."""
    folder, maps = made / "degraded", made / "degraded_buildings"
    count = max(1, sizes.goals // 4)
    buildings = _buildings(maps, sizes.numbers(max(0, count - len(SHIPPED))))
    built = {**_shipped(folder, worlds), **buildings}
    chosen = {name: built[name] for name in list(built)[:count]}
    return random_goals.degraded(folder, chosen, sizes.first, (worlds.absolute(), maps.absolute()))


def _shipped(folder: Path, worlds: Path) -> Mapping[str, BuiltWorld]:
    return _built(folder, worlds, [f"{name}.world.yaml" for name in SHIPPED])


def _buildings(folder: Path, numbers: Sequence[int]) -> Mapping[str, BuiltWorld]:
    return _built(folder, folder, [write_building(number, folder).name for number in numbers])


def _built(folder: Path, worlds: Path, files: Sequence[str]) -> Mapping[str, BuiltWorld]:
    """Return the built worlds by the names that scenarios in `folder` use for them."""
    from simscen.loading.builders import world_from_file
    from simscen.loading.files.single_files import load_world_file
    from simscen.worlds.built_world import build_world_and_map

    folder.mkdir(parents=True, exist_ok=True)
    return {
        file: build_world_and_map(world_from_file(load_world_file(worlds / file, worlds), worlds), LIDAR_HEIGHT)
        for file in files
    }
