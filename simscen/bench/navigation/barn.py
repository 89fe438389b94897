"""Scenarios of the BARN navigation challenge (Perille et al., SSRR 2020; the-barn-challenge, run.py).

A robot with the size of a Jackal drives 10 m through a field of cylinders without a map. Any contact ends the run.
"""

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from simscen.core.errors import UsageError
from simscen.core.geometry import Pose2

TIME_LIMIT = 100.0
DWA = {"success": 0.850, "collisions": 0.056, "timeouts": 0.094, "score": 0.159}
"""Published results of the dynamic window approach at 0.5 m/s in 50 worlds with 10 runs each."""

START, GOAL = Pose2(-2.25, 3.0, 1.57), Pose2(-2.25, 13.0, 1.57)

WHEELS = "type: slip_ekf, rotation_noise: 0.5"
"""Like robot_localization on the Jackal: distance from the wheels, rotation from the gyroscope."""
LOCALIZER = f"{{{WHEELS}, match_scans: true}}"
"""WHEELS with a laser scan matcher, which corrects the distance when the wheels slip."""
COSTMAP = "{obstacle_max_range: 8 m, raytrace_max_range: 10 m, update_frequency: 10 Hz}"
TUNED = f"""\
  localizer: {LOCALIZER}
  costmap: {COSTMAP}
  # Nav2's 0.9 m is for 0.5 m/s; at 2 m/s, this radius gives a lateral acceleration of 2 m/s².
  controller:
    type: regulated_pure_pursuit  # explicit, so that another controller replaces it as a whole
    desired_linear_vel: 2 m/s
    regulated_linear_scaling_min_radius: 2 m
"""
"""Stack parameters for the speed of the challenge."""
TUNED_FOR_MOVING_WORLDS = TUNED.replace(LOCALIZER, f"{{{WHEELS}}}")
"""TUNED without scan matching, for worlds in which everything that the lidar sees may move."""
DEFAULT = f"  localizer: {LOCALIZER}\n"
"""Default parameters: 0.5 m/s."""
CONTROLLERS = {
    f"{name} at 0.5 m/s": f"  localizer: {LOCALIZER}\n  costmap: {COSTMAP}\n  controller: {parameters}\n"
    for name, parameters in (
        ("regulated pure pursuit", "{type: regulated_pure_pursuit, desired_linear_vel: 0.5 m/s}"),
        ("dwb", "{type: dwb, max_vel_x: 0.5 m/s}"),
        ("mppi", "{type: mppi, vx_max: 0.5 m/s}"),
    )
}
"""Stack parameters of each shipped controller at the speed of DWA in the challenge."""

SETUP = """\
map: none
robot: {model: jackal, pose: <start>}
stack:
<stack>goals:
  - {name: beyond, pose: <goal>, xy_tolerance: 0.5 m, yaw_tolerance: 180 deg}
time_limit: 100 s
linger: 0
events:
  - {name: contact ends the run, when: {collision: {}}, do: {cancel_goal: {}}, required: false}
pass:
  - goals_reached: {tolerance: 1 m}
  - collisions: {max: 0}
"""
"""Scenario without its world, stack parameters, start and goal."""


@dataclass(frozen=True)
class BarnWorld:
    """World file of the challenge, and the length in m of the reference path for its score."""

    file: Path
    reference_length: float


def barn_worlds(folder: Path) -> list[BarnWorld]:
    """Return the worlds that scenarios.csv in `folder` lists. Raises UsageError if the file is invalid."""
    file = folder / "scenarios.csv"
    try:
        with file.open(newline="", encoding="utf-8") as lines:
            worlds = list(_parse_rows(file, csv.DictReader(lines)))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"cannot read the list of BARN's worlds: {error}") from error
    if not worlds:
        raise UsageError(f"{file}: lists no worlds")
    return worlds


def _parse_rows(file: Path, rows: Iterable[dict[str, str]]) -> Iterable[BarnWorld]:
    for number, row in enumerate(rows, start=2):
        try:
            world, length = int(row["world"]), float(row["ref_path_len"])
        except KeyError as error:
            raise UsageError(f"{file}: no column {error}") from error
        except (TypeError, ValueError) as error:
            raise UsageError(f"{file}, line {number}: {error}") from error
        if not 0.0 < length < math.inf:
            raise UsageError(f"{file}, line {number}: a path is longer than 0 m, not {length:g}")
        yield BarnWorld(file.parent / f"world_{world}.world", length)


def scenario(name: str, world: str, start: Pose2 = START, goal: Pose2 = GOAL, stack: str = TUNED) -> str:
    """Return the text of a scenario. `world` is the value of `world:`, `stack` the lines below `stack:`."""
    setup = SETUP.replace("<stack>", stack).replace("<start>", _pose(start)).replace("<goal>", _pose(goal))
    return f"simscen: 1\nname: {name}\nworld: {world}\n{setup}"


def _pose(pose: Pose2) -> str:
    return f"{{x: {pose.x}, y: {pose.y}, yaw: {pose.yaw}}}"
