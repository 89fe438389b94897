"""The BARN navigation challenge: its set-up, its score, and what a classical planner reaches in it.

Perille et al., SSRR 2020; the-barn-challenge, run.py. A robot of a Jackal's size drives 10 m ahead through a field of
cylinders that it has no map of; any contact ends the run.
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
"""Published for the dynamic window approach at 0.5 m/s in 50 worlds, 10 runs each."""

START, GOAL = Pose2(-2.25, 3.0, 1.57), Pose2(-2.25, 13.0, 1.57)

WHEELS = "type: slip_ekf, rotation_noise: 0.5"
"""As the Jackal's own robot_localization: wheels for the way, the gyroscope for turns, of which skidding wheels know
little."""
LOCALIZER = f"{{{WHEELS}, match_scans: true}}"
"""The same with a laser scan matcher beside it: what stands tells how far the robot came when its wheels slip."""
COSTMAP = "{obstacle_max_range: 8 m, raytrace_max_range: 10 m, update_frequency: 10 Hz}"
TUNED = f"""\
  localizer: {LOCALIZER}
  costmap: {COSTMAP}
  # Nav2's 0.9 m is for 0.5 m/s; at 2 m/s this bend is 2 m/s² sideways.
  controller:
    type: regulated_pure_pursuit  # said, so that another stack's controller takes its place as a whole
    desired_linear_vel: 2 m/s
    regulated_linear_scaling_min_radius: 2 m
"""
"""The stack's parameters for the speed of the challenge."""
AMONG_MOVING = TUNED.replace(LOCALIZER, f"{{{WHEELS}}}")
"""The same where all that a lidar sees may move, and so says nothing of the robot's way."""
DEFAULT = f"  localizer: {LOCALIZER}\n"
"""No parameter changed: 0.5 m/s."""
CONTROLLERS = {
    f"{name} at 0.5 m/s": f"  localizer: {LOCALIZER}\n  costmap: {COSTMAP}\n  controller: {said}\n"
    for name, said in (
        ("regulated pure pursuit", "{type: regulated_pure_pursuit, desired_linear_vel: 0.5 m/s}"),
        ("dwb", "{type: dwb, max_vel_x: 0.5 m/s}"),
        ("mppi", "{type: mppi, vx_max: 0.5 m/s}"),
    )
}
"""Each of our own controllers at the speed of the challenge's DWA."""

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
"""All of a scenario but its world, its stack and where it is driven; the same for worlds of others."""


@dataclass(frozen=True)
class BarnWorld:
    """One world of the challenge: its file, and the length in meters of the reference path that its score refers to."""

    file: Path
    reference_length: float


def barn_worlds(folder: Path) -> list[BarnWorld]:
    """The worlds that are in a folder, as its scenarios.csv lists them. Raises UsageError where that is not usable."""
    file = folder / "scenarios.csv"
    try:
        with file.open(newline="", encoding="utf-8") as lines:
            worlds = list(_listed(file, csv.DictReader(lines)))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"cannot read the list of BARN's worlds: {error}") from error
    if not worlds:
        raise UsageError(f"{file}: lists no worlds")
    return worlds


def _listed(file: Path, rows: Iterable[dict[str, str]]) -> Iterable[BarnWorld]:
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
    """The text of a scenario; `world` is what stands after `world:`, `stack` the lines below `stack:`."""
    setup = SETUP.replace("<stack>", stack).replace("<start>", _pose(start)).replace("<goal>", _pose(goal))
    return f"simscen: 1\nname: {name}\nworld: {world}\n{setup}"


def _pose(pose: Pose2) -> str:
    return f"{{x: {pose.x}, y: {pose.y}, yaw: {pose.yaw}}}"
