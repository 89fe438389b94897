"""Experiments of `simscen bench nav`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from simscen.bench.navigation import barn, experiments, office_maps, random_goals
from simscen.bench.navigation.experiments import Experiment
from simscen.bench.navigation.office_maps import write_building

if TYPE_CHECKING:
    from simscen.core.environment.world_model import BuiltWorld

SHIPPED_WORLDS = ("house", "office", "warehouse")
BARN_SOURCE = "--barn names a folder with its worlds: https://www.cs.utexas.edu/~xiao/BARN/BARN.html"
NAV2_SOURCE = "--nav2 names a folder with it: https://github.com/ros-navigation/nav2_minimal_turtlebot_simulation"
LIDAR_HEIGHT_M = 0.2
"""Height of the lidar for which the maps of worlds are generated."""


@dataclass(frozen=True)
class Sizes:
    """Size of the experiments, and the `first` number of their fields, buildings, drives, and seeds.

    `seeds` is None for the default number of each experiment.
    """

    first: int = 1
    seeds: int | None = None
    fields: int = 50
    dynamic: int = 20
    goals: int = 20
    lost: int = 50

    def seeds_or(self, default: int) -> Sequence[int]:
        """Return the seeds of a scenario that runs with `default` seeds unless `seeds` is set."""
        return self.numbers(self.seeds or default)

    def numbers(self, count: int) -> Sequence[int]:
        """Return `count` numbers starting at `first`."""
        return range(self.first, self.first + count)


@dataclass(frozen=True)
class AvailableExperiment:
    """Group of experiments, the folder that it needs, and the function that creates it.

    `parts` are the names of its experiments that differ from its own; creating all experiments may take a while.
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
    data: Path | None, nav2: Path | None, project: Path, generated: Path, sizes: Sizes
) -> list[AvailableExperiment]:
    """Return all groups of experiments in the order of the table; generated files are written to `generated`."""
    worlds, scenarios = project / "worlds", project / "scenarios"
    return [
        replace(group, parts=_parts(group.name, scenarios))
        for group in _experiment_groups(data, nav2, worlds, scenarios, generated, sizes)
    ]


def _parts(name: str, scenarios: Path) -> list[str]:
    """Return the names of the experiments of a group that differ from its name."""
    match name:
        case "BARN":
            return [f"BARN, {variant}" for variant in ("default parameters", *barn.CONTROLLERS)]
        case "narrow fields":
            return [experiments.narrow_name(margin) for margin in experiments.NARROW_MARGINS_M]
        case "dynamic fields":
            return [experiments.dynamic_name(speed) for speed in barn.SPEEDS_M_S]
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


def _experiment_groups(
    data: Path | None, nav2: Path | None, worlds: Path, scenarios: Path, generated: Path, sizes: Sizes
) -> list[AvailableExperiment]:
    return [
        AvailableExperiment("BARN", data, lambda: list(_barn(generated, data or Path(), sizes)), BARN_SOURCE),
        AvailableExperiment(
            "generated fields",
            generated,
            lambda: [experiments.generated_fields(generated, sizes.numbers(sizes.fields))],
        ),
        AvailableExperiment(
            "narrow fields", generated, lambda: experiments.narrow_fields(generated, sizes.numbers(sizes.fields // 2))
        ),
        AvailableExperiment(
            "dynamic fields", generated, lambda: experiments.dynamic_fields(generated, sizes.numbers(sizes.dynamic))
        ),
        AvailableExperiment("random goals", worlds, lambda: list(_random_goals(generated, worlds, sizes))),
        AvailableExperiment("degraded sensing", worlds, lambda: _degraded(generated, worlds, sizes)),
        AvailableExperiment(
            "ramps", generated, lambda: [office_maps.ramps(generated / "ramps", sizes.numbers(sizes.goals))]
        ),
        AvailableExperiment(
            "two robots",
            generated,
            lambda: [office_maps.two_robots(generated / "corridors", sizes.numbers(sizes.goals))],
        ),
        AvailableExperiment(
            "tb3_sandbox", nav2, lambda: experiments.sandbox(generated, nav2 or Path(), sizes.seeds_or(20)), NAV2_SOURCE
        ),
        AvailableExperiment(
            "corner cases", scenarios, lambda: experiments.corner_cases(scenarios, scenarios.parent, sizes.seeds_or(20))
        ),
        AvailableExperiment(
            "localization",
            worlds,
            lambda: experiments.localization_experiments(
                generated, worlds, sizes.seeds_or(20), sizes.numbers(sizes.lost)
            ),
        ),
    ]


def _barn(generated: Path, data: Path, sizes: Sizes) -> Iterator[Experiment]:
    """Yield the BARN challenge at 2 m/s, with default parameters, and with each controller at the same speed."""
    seeds = sizes.seeds_or(5)
    yield experiments.barn_challenge(generated, data, seeds)
    yield experiments.barn_challenge(generated, data, seeds, "default parameters", barn.DEFAULT_STACK)
    for controller, stack in barn.CONTROLLERS.items():
        yield experiments.barn_challenge(generated, data, seeds, controller, stack)


def _random_goals(generated: Path, worlds: Path, sizes: Sizes) -> Iterator[Experiment]:
    folder, maps = generated / "random_goals", generated / "buildings"
    yield random_goals.random_goals(
        "random goals", folder, _shipped_worlds(folder, worlds), sizes.numbers(sizes.goals), (worlds.absolute(),)
    )
    buildings = _generated_buildings(maps, sizes.numbers(sizes.goals))
    yield random_goals.random_goals("random goals, ROS maps", maps, buildings, range(1, 4))


def _degraded(generated: Path, worlds: Path, sizes: Sizes) -> list[Experiment]:
    """Return the experiments in shipped worlds and generated buildings, a quarter as many worlds as `goals`."""
    folder, maps = generated / "degraded", generated / "degraded_buildings"
    count = max(1, sizes.goals // 4)
    buildings = _generated_buildings(maps, sizes.numbers(max(0, count - len(SHIPPED_WORLDS))))
    built = {**_shipped_worlds(folder, worlds), **buildings}
    selected = {name: built[name] for name in list(built)[:count]}
    return random_goals.degraded(folder, selected, sizes.first, (worlds.absolute(), maps.absolute()))


def _shipped_worlds(folder: Path, worlds: Path) -> Mapping[str, BuiltWorld]:
    return _build_worlds(folder, worlds, [f"{name}.world.yaml" for name in SHIPPED_WORLDS])


def _generated_buildings(folder: Path, numbers: Sequence[int]) -> Mapping[str, BuiltWorld]:
    return _build_worlds(folder, folder, [write_building(number, folder).name for number in numbers])


def _build_worlds(folder: Path, worlds: Path, files: Sequence[str]) -> Mapping[str, BuiltWorld]:
    """Return the built worlds by the names that scenarios in `folder` use for them."""
    from simscen.loading.builders import world_from_file
    from simscen.loading.files.single_files import load_world_file
    from simscen.worlds.built_world import build_world_and_map

    folder.mkdir(parents=True, exist_ok=True)
    return {
        file: build_world_and_map(world_from_file(load_world_file(worlds / file, worlds), worlds), LIDAR_HEIGHT_M)
        for file in files
    }
