"""Experiments of `simscen bench nav` that measure localization, with drives through the shipped house."""

import math
from collections.abc import Sequence
from pathlib import Path

from simscen.bench.navigation.experiments import Drive, Experiment, write_text
from simscen.core.random_streams import Streams

LOCALIZATION_EXPERIMENTS = {
    "tour": True,
    "start 0.5 m and 20° off": True,
    "start unknown": False,
    "kidnapped": False,
}
"""Localization experiments by name, and whether the errors of their pose estimates are measured as well."""
START_X_M, START_Y_M = 0.8, 4.95
"""Start of all drives, at the place `dock` of the house. The yaw is 0."""
ESTIMATE_OFFSET_M, ESTIMATE_ROTATION_RAD = 0.5, math.radians(20.0)
"""Position and yaw error of a wrong initial estimate."""

TOUR = """\
simscen: 1
name: tour of the house
world: house.world.yaml
robot: {pose: dock}
goals:
  - {pose: sofa, timeout: 120 s}
  - {pose: kitchen, timeout: 120 s}
  - {pose: study, timeout: 120 s}
pass:
  - goals_reached: {}
  - localization_error: {rmse: 5 cm, after: 5 s}
  - collisions: {max: 0}
"""
"""Scenario of a drive through three rooms with a known start."""
SELF_LOCALIZATION_LINES = """\
goals:
  - {pose: kitchen, timeout: 200 s}
time_limit: 210 s
pass:
  - goals_reached: {}
  - localization_error: {final: 0.2 m}
  - collisions: {max: 0, caused_by_robot: true}
"""
"""Last lines of the scenarios in which the robot must localize itself."""
START_UNKNOWN = f"""\
simscen: 1
name: start unknown
world: house.world.yaml
robot: {{pose: dock, initial_estimate: unknown}}
{SELF_LOCALIZATION_LINES}"""
"""Scenario of a drive without an initial estimate."""
KIDNAPPED = f"""\
simscen: 1
name: kidnapped
world: house.world.yaml
robot: {{pose: dock}}
events:
  - {{name: kidnapped, when: {{travelled: 3 m}}, do: {{kidnap: {{pose: {{x: 9.4, y: 7.3, yaw: 90 deg}}}}}}}}
{SELF_LOCALIZATION_LINES}"""
"""Scenario of a drive in which the robot is kidnapped to the room "study" after 3 m."""


def write_localization_experiments(
    folder: Path, worlds: Path, tour_seeds: Sequence[int], lost_seeds: Sequence[int]
) -> list[Experiment]:
    """Write the LOCALIZATION_EXPERIMENTS in the world `house.world.yaml` of the folder `worlds`.

    The experiment "tour" has the seeds `tour_seeds`, and the others the seeds `lost_seeds`. If `lost_seeds` is empty,
    only "tour" is written.
    """

    def drive(stem: str, text: str, seeds: Sequence[int]) -> Drive:
        return Drive(write_text(folder / f"localization/{stem}.scenario.yaml", text), seeds, world="house")

    drives = [[drive("tour", TOUR, tour_seeds)]]
    if lost_seeds:
        drives += [
            [drive(f"wrong_start_{seed}", _wrong_start_scenario(seed), [seed]) for seed in lost_seeds],
            [drive("start_unknown", START_UNKNOWN, lost_seeds)],
            [drive("kidnapped", KIDNAPPED, lost_seeds)],
        ]
    return [
        Experiment(f"localization, {name}", tuple(members), folder, (worlds,), measures_localization=is_measured)
        for (name, is_measured), members in zip(LOCALIZATION_EXPERIMENTS.items(), drives, strict=False)
    ]


def _wrong_start_scenario(seed: int) -> str:
    """Return the scenario YAML of a drive with a wrong initial estimate.

    The estimate is shifted by ESTIMATE_OFFSET_M in a random direction, and rotated by ESTIMATE_ROTATION_RAD: to the
    left for an even seed, to the right for an odd one.
    """
    direction = float(Streams(seed).generator("direction").uniform(-math.pi, math.pi))
    x, y = START_X_M + ESTIMATE_OFFSET_M * math.cos(direction), START_Y_M + ESTIMATE_OFFSET_M * math.sin(direction)
    yaw = ESTIMATE_ROTATION_RAD if seed % 2 == 0 else -ESTIMATE_ROTATION_RAD
    return f"""\
simscen: 1
name: wrong initial estimate
world: house.world.yaml
robot:
  pose: dock
  initial_estimate: {{x: {x:.4f}, y: {y:.4f}, yaw: {yaw:.5f}}}
goals:
  - {{pose: kitchen, timeout: 120 s}}
pass:
  - goals_reached: {{}}
  - localization_error: {{final: 10 cm}}
  - collisions: {{max: 0}}
"""
