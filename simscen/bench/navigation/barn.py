"""Drives in the worlds of the BARN challenge, and stacks and scenarios for mapless drives like those of the challenge.

In BARN (Perille et al., SSRR 2020), a Jackal drives 10 m through a field of cylinders without a map. Any contact ends
the run.
"""

import csv
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from simscen.bench.navigation.experiments import Drive, Experiment, write_text
from simscen.core.errors import UsageError
from simscen.core.geometry import Pose2

PUBLISHED_DWA_RESULTS = {"success": 0.850, "collisions": 0.056, "timeouts": 0.094, "score": 0.159}
"""Published results of the dynamic window approach (DWA) in BARN at 0.5 m/s, from 50 worlds with 10 runs each."""

START, GOAL = Pose2(-2.25, 3.0, 1.57), Pose2(-2.25, 13.0, 1.57)
"""Start and goal of the robot in BARN."""

LOCALIZER = "{type: slip_ekf, rotation_noise: 0.5, match_scans: true}"
"""YAML of a localizer that combines wheel odometry, the gyroscope, and the matching of laser scans."""
COSTMAP = "{obstacle_max_range: 8 m, raytrace_max_range: 10 m, update_frequency: 10 Hz}"
"""YAML of the costmap parameters for mapless drives."""
TUNED_STACK = f"""\
  localizer: {LOCALIZER}
  costmap: {COSTMAP}
  # Nav2's 0.9 m is for 0.5 m/s; at 2 m/s, this radius gives a lateral acceleration of 2 m/s².
  controller:
    type: regulated_pure_pursuit  # explicit, so that another controller replaces it as a whole
    desired_linear_vel: 2 m/s
    regulated_linear_scaling_min_radius: 2 m
"""
"""YAML lines of `stack:` for 2 m/s, the speed of the challenge."""
DEFAULT_STACK = f"  localizer: {LOCALIZER}\n"
"""YAML lines of `stack:` with the default controller at its default speed of 0.5 m/s."""
CONTROLLERS = {
    f"{name} at 0.5 m/s": f"  localizer: {LOCALIZER}\n  costmap: {COSTMAP}\n  controller: {parameters}\n"
    for name, parameters in (
        ("regulated pure pursuit", "{type: regulated_pure_pursuit, desired_linear_vel: 0.5 m/s}"),
        ("dwb", "{type: dwb, max_vel_x: 0.5 m/s}"),
        ("mppi", "{type: mppi, vx_max: 0.5 m/s}"),
    )
}
"""YAML lines of `stack:` for each shipped controller at 0.5 m/s, the speed of the published results."""


@dataclass(frozen=True)
class BarnWorld:
    """World file of the BARN challenge, and the length in m of the reference path for the BARN score."""

    file: Path
    reference_length: float


def read_barn_worlds(folder: Path) -> list[BarnWorld]:
    """Return the worlds listed in the file scenarios.csv in `folder`. Raises UsageError if it is missing or invalid."""
    file = folder / "scenarios.csv"
    try:
        with file.open(newline="", encoding="utf-8-sig") as lines:  # spreadsheets write a byte order mark
            worlds = list(_parse_rows(file, csv.DictReader(lines)))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"cannot read the list of BARN's worlds: {error}") from error
    if not worlds:
        raise UsageError(f"{file}: lists no worlds")
    return worlds


def _parse_rows(file: Path, rows: Iterable[dict[str, str]]) -> Iterable[BarnWorld]:
    """Yield the world of each row of the CSV `file`. Raises UsageError for an invalid row."""
    for number, row in enumerate(rows, start=2):
        try:
            world, length = int(row["world"]), float(row["ref_path_len"])
        except KeyError as error:
            raise UsageError(f"{file}: no column {error}") from error
        except (TypeError, ValueError) as error:
            raise UsageError(f"{file}, line {number}: {error}") from error
        if not 0.0 < length < math.inf:
            raise UsageError(f"{file}, line {number}: `ref_path_len` must be a length above 0 m, not {length:g}")
        yield BarnWorld(file.parent / f"world_{world}.world", length)


def scenario_text(name: str, world: str, start: Pose2 = START, goal: Pose2 = GOAL, stack: str = TUNED_STACK) -> str:
    """Return the YAML of a scenario. `world` is the value of `world:`, and `stack` the lines below `stack:`."""
    return f"""\
simscen: 1
name: {name}
world: {world}
map: none
robot: {{model: jackal, pose: {_pose_yaml(start)}}}
stack:
{stack}goals:
  - {{name: beyond, pose: {_pose_yaml(goal)}, xy_tolerance: 0.5 m, yaw_tolerance: 180 deg}}
time_limit: 100 s
linger: 0
events:
  - {{name: contact ends the run, when: {{collision: {{}}}}, do: {{cancel_goal: {{}}}}, required: false}}
pass:
  - goals_reached: {{tolerance: 1 m}}
  - collisions: {{max: 0}}
"""


def _pose_yaml(pose: Pose2) -> str:
    return f"{{x: {pose.x}, y: {pose.y}, yaw: {pose.yaw}}}"


def write_barn_challenge(
    folder: Path, dataset: Path, seeds: Sequence[int], variant: str = "", stack: str = TUNED_STACK
) -> Experiment:
    """Write a drive in each world of BARN. `dataset` is the folder with the worlds.

    `stack` are the YAML lines below `stack:`. `variant` is the name of this stack; "" for TUNED_STACK. Raises
    UsageError if the list of the worlds is missing or invalid.
    """
    name = f"BARN, {variant}" if variant else "BARN"
    drives = []
    for world in read_barn_worlds(dataset):
        text = scenario_text(world.file.stem, world.file.name, stack=stack)
        file = folder / "barn" / (variant.replace("/", " per ") or "tuned") / f"{world.file.stem}.scenario.yaml"
        drives.append(Drive(write_text(file, text), seeds, world.reference_length))
    return Experiment(name, tuple(drives), folder, (dataset,), is_mapless=True)
