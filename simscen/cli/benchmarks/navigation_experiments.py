"""Groups of experiments of `simscen bench nav`. Scenario files are written only for the selected groups."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from simscen.bench.navigation import (
    barn,
    experiments,
    generated_worlds,
    localization_drives,
    moving_cylinders,
    obstacle_fields,
    random_goals,
)
from simscen.bench.navigation.experiments import Experiment
from simscen.bench.navigation.generated_worlds import write_office_map

if TYPE_CHECKING:
    from simscen.core.environment.world_model import BuiltWorld

SHIPPED_WORLDS = ("house", "office", "warehouse")
"""Names of the shipped worlds in which robots drive to random goals."""
BARN_HINT = "pass the folder of the BARN worlds as --barn; download: https://www.cs.utexas.edu/~xiao/BARN/BARN.html"
NAV2_HINT = (
    "pass the folder of Nav2's TurtleBot 3 simulation as --nav2; "
    "download: https://github.com/ros-navigation/nav2_minimal_turtlebot_simulation"
)
"""Messages if the option --barn or --nav2 is missing."""
LIDAR_HEIGHT_M = 0.2
"""Height of the lidar for the maps of the worlds."""


@dataclass(frozen=True)
class Sizes:
    """Sizes of the experiments: the options of `simscen bench nav` with the same names.

    first:    number of the first field, building, drive, and seed
    seeds:    number of seeds of BARN, Nav2's system test, corner cases, and localization; None for their defaults
    fields:   number of generated obstacle fields; there are half as many narrow fields
    dynamic:  number of fields of moving cylinders at each speed
    goals:    number of random goals in each shipped world, of generated buildings, of ramps, and of corridors
    lost:     number of drives with a wrong start, of drives with an unknown start, and of kidnappings
    """

    first: int = 1
    seeds: int | None = None
    fields: int = 50
    dynamic: int = 20
    goals: int = 20
    lost: int = 50

    def scenario_seeds(self, default_count: int) -> Sequence[int]:
        """Return the seeds of a scenario; `default_count` seeds if `seeds` is None."""
        return self.numbers(self.seeds or default_count)

    def numbers(self, count: int) -> Sequence[int]:
        """Return `count` consecutive numbers, starting at `first`."""
        return range(self.first, self.first + count)


@dataclass(frozen=True)
class ExperimentGroup:
    """Group of experiments that need the same data.

    name:               name of the group
    data_folder:        folder with the data; None if the option for the folder was not given
    write_experiments:  function that writes the scenario files, and returns the experiments
    other_names:        names of the experiments of the group that differ from `name`
    missing_hint:       message if `data_folder` is None
    """

    name: str
    data_folder: Path | None
    write_experiments: Callable[[], Iterable[Experiment]]
    other_names: Sequence[str] = ()
    missing_hint: str = ""

    @property
    def missing_message(self) -> str:
        """Message that the data is missing; "" if the data is available."""
        if self.data_folder is None:
            return self.missing_hint
        return "" if self.data_folder.is_dir() else f"there is no folder {self.data_folder}"


def experiment_groups(
    barn_data: Path | None, nav2: Path | None, project: Path, generated: Path, sizes: Sizes
) -> list[ExperimentGroup]:
    """Return all groups of experiments in the order of the result table.

    `barn_data` and `nav2` are the folders of --barn and --nav2; None without these options. `project` is the folder
    with simscen's scenarios and worlds. `generated` is the folder for generated files.
    """
    worlds, scenarios = project / "worlds", project / "scenarios"
    seeds, goals = sizes.scenario_seeds(20), sizes.numbers(sizes.goals)
    return [
        ExperimentGroup(
            "BARN",
            barn_data,
            lambda: _barn(generated, barn_data or Path(), sizes),
            [f"BARN, {variant}" for variant in ("default parameters", *barn.CONTROLLERS)],
            BARN_HINT,
        ),
        ExperimentGroup(
            "generated fields",
            generated,
            lambda: [obstacle_fields.write_generated_fields(generated, sizes.numbers(sizes.fields))],
        ),
        ExperimentGroup(
            "narrow fields",
            generated,
            lambda: obstacle_fields.write_narrow_fields(generated, sizes.numbers(sizes.fields // 2)),
            [obstacle_fields.narrow_fields_name(margin) for margin in obstacle_fields.NARROW_MARGINS_M],
        ),
        ExperimentGroup(
            "dynamic fields",
            generated,
            lambda: moving_cylinders.write_dynamic_fields(generated, sizes.numbers(sizes.dynamic)),
            [moving_cylinders.dynamic_fields_name(speed) for speed in moving_cylinders.SPEEDS_M_S],
        ),
        ExperimentGroup(
            "random goals", worlds, lambda: _random_goals(generated, worlds, sizes), ["random goals, ROS maps"]
        ),
        ExperimentGroup(
            "degraded sensing",
            worlds,
            lambda: _degraded_sensing(generated, worlds, sizes),
            [f"degraded sensing, {strength}" for strength in random_goals.STRENGTHS],
        ),
        ExperimentGroup("ramps", generated, lambda: [generated_worlds.write_ramps(generated / "ramps", goals)]),
        ExperimentGroup(
            "two robots",
            generated,
            lambda: [generated_worlds.write_two_robots(generated / "corridors", goals)],
            ["two robots in a corridor"],
        ),
        ExperimentGroup(
            "tb3_sandbox",
            nav2,
            lambda: experiments.write_sandbox(generated, nav2 or Path(), seeds),
            ["tb3_sandbox, unmapped box"],
            NAV2_HINT,
        ),
        ExperimentGroup(
            "corner cases",
            scenarios,
            lambda: experiments.corner_cases(scenarios, seeds),
            [case.name for case in experiments.corner_cases(scenarios, ())],
        ),
        ExperimentGroup(
            "localization",
            worlds,
            lambda: localization_drives.write_localization_experiments(
                generated, worlds, seeds, sizes.numbers(sizes.lost)
            ),
            [f"localization, {name}" for name in localization_drives.LOCALIZATION_EXPERIMENTS],
        ),
    ]


def _barn(generated: Path, barn_data: Path, sizes: Sizes) -> Iterator[Experiment]:
    """Write the experiments of BARN: the tuned stack at 2 m/s, the default stack, and each controller at 0.5 m/s."""
    seeds = sizes.scenario_seeds(5)
    yield barn.write_barn_challenge(generated, barn_data, seeds)
    yield barn.write_barn_challenge(generated, barn_data, seeds, "default parameters", barn.DEFAULT_STACK)
    for controller, stack in barn.CONTROLLERS.items():
        yield barn.write_barn_challenge(generated, barn_data, seeds, controller, stack)


def _random_goals(generated: Path, worlds: Path, sizes: Sizes) -> Iterator[Experiment]:
    """Write the experiments with random goals in shipped worlds, and with three goals on each generated ROS map."""
    folder, maps = generated / "random_goals", generated / "buildings"
    numbers, shipped = sizes.numbers(sizes.goals), _shipped_worlds(folder, worlds)
    yield random_goals.write_random_goals("random goals", folder, shipped, numbers, (worlds.absolute(),))
    buildings = _generated_buildings(maps, numbers)
    yield random_goals.write_random_goals("random goals, ROS maps", maps, buildings, range(1, 4))


def _degraded_sensing(generated: Path, worlds: Path, sizes: Sizes) -> list[Experiment]:
    """Write the experiments with sensor faults in `sizes.goals` / 4 worlds, at least one."""
    folder, maps = generated / "degraded", generated / "degraded_buildings"
    count = max(1, sizes.goals // 4)
    buildings = _generated_buildings(maps, sizes.numbers(max(0, count - len(SHIPPED_WORLDS))))
    built = {**_shipped_worlds(folder, worlds), **buildings}
    selected = {name: built[name] for name in list(built)[:count]}
    return random_goals.write_degraded_sensing(folder, selected, sizes.first, (worlds.absolute(), maps.absolute()))


def _shipped_worlds(folder: Path, worlds: Path) -> Mapping[str, BuiltWorld]:
    return _build_worlds(folder, worlds, [f"{name}.world.yaml" for name in SHIPPED_WORLDS])


def _generated_buildings(folder: Path, numbers: Sequence[int]) -> Mapping[str, BuiltWorld]:
    return _build_worlds(folder, folder, [write_office_map(number, folder).name for number in numbers])


def _build_worlds(folder: Path, worlds: Path, files: Sequence[str]) -> Mapping[str, BuiltWorld]:
    """Build the worlds of these files in the folder `worlds`, and return them by file name. Create `folder`."""
    from simscen.loading.builders import world_from_file
    from simscen.loading.files.single_files import load_world_file
    from simscen.worlds.built_world import build_world_and_map

    folder.mkdir(parents=True, exist_ok=True)
    return {
        file: build_world_and_map(world_from_file(load_world_file(worlds / file, worlds), worlds), LIDAR_HEIGHT_M)
        for file in files
    }
