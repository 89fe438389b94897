"""Check a robot in a trial drive: does it follow its commands, and is its odometry correct?"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from simscen.model.robot import Drive, Mecanum, SkidSteer
from simscen.run.trial_drive import RestingState, Trial, run_trials
from simscen.sim.body.climb import ClimbLimits, compute_climb_limits
from simscen.sim.body.robot_body import RobotBody

LEAN, LIFT, CREEP = math.radians(1.0), 0.002, 0.001
"""At rest: rad, m above or below its wheels' ground, m in a second."""
STRAIGHT, SLIP = 0.02, 0.01
"""Of the line: distance driven over commanded, and over what the encoders say; both beyond 1."""
HEADING, TILT = math.radians(2.0), math.radians(3.0)
"""rad: heading at the end of the line, and how far the base may lean at any time."""
FITTING = 0.005
"""Relative deviation of a dimension that needs no correction."""
ROLLING = (0.02, 0.02, 0.02, 0.05)
SKIDDING = (0.10, 0.03, 0.04, 0.50)
"""Angle turned over commanded, and over what the encoders say; end of the square by odometry from the true one, over
the way driven; off the spot while turning on it, over the radius that the base takes to turn. Wheels that skid turn a
base as if they stood further apart, by a ratio that changes with load and speed: no track fits every turn (Mandow et
al., Experimental kinematics for wheeled skid-steer mobile robots, IROS 2007)."""


@dataclass(frozen=True)
class DriveCheck:
    """A measured value and its limit, both in `unit`. `advice` is a possible correction."""

    name: str
    value: float
    limit: float
    unit: str
    advice: str = ""

    @property
    def held(self) -> bool:
        """Whether the value is within its limit."""
        return self.value <= self.limit


@dataclass(frozen=True)
class RobotCheckResult:
    """Results of all checks of a robot."""

    rest: RestingState
    trials: tuple[Trial, ...]
    checks: tuple[DriveCheck, ...]
    climb: ClimbLimits

    @property
    def failed(self) -> int:
        """Number of failed checks."""
        return sum(not check.held for check in self.checks)


def check_robot(body: RobotBody) -> RobotCheckResult:
    """Drive a robot and check it. Raises RunError if the simulation becomes unstable."""
    rest, trials = run_trials(body)
    return RobotCheckResult(
        rest, trials, tuple(_checks(body, rest, {trial.name: trial for trial in trials})), compute_climb_limits(body)
    )


def _checks(body: RobotBody, rest: RestingState, trials: dict[str, Trial]) -> Iterator[DriveCheck]:
    turned, reckoned, ends, off = SKIDDING if isinstance(body.drive, SkidSteer) else ROLLING
    yield DriveCheck("at rest: leans", math.degrees(rest.tilt), math.degrees(LEAN), "deg", "its wheels do not carry it")
    yield DriveCheck("at rest: off its wheels' ground", 1e3 * abs(rest.height), 1e3 * LIFT, "mm")
    yield DriveCheck("at rest: creeps in a second", 1e3 * rest.crept, 1e3 * CREEP, "mm")
    line = trials["line"]
    yield _share("line: driven, from commanded", line.truth.driven, line.command.driven, STRAIGHT)
    yield DriveCheck("line: heading at its end", _degrees(line.truth.end.yaw), math.degrees(HEADING), "deg")
    advice = _radius_that_fits(body.drive, line)
    yield _share("line: odometry, from true distance", line.odometry.driven, line.truth.driven, SLIP, advice)
    turn = trials.get("turn") or trials["circle"]
    advice = _track_that_fits(body.drive, turn, line) or advice
    yield _share(f"{turn.name}: turned, from commanded", turn.truth.turned, turn.command.turned, turned, advice)
    yield _share(f"{turn.name}: odometry, from true angle", turn.odometry.turned, turn.truth.turned, reckoned, advice)
    if turn.name == "turn":
        far = max(math.hypot(pose.x, pose.y) for pose in turn.truth.path)
        yield DriveCheck("turn: off the spot", far, off * body.circumscribed_radius, "m", _offset(body))
    if sideways := trials.get("sideways"):
        yield _share("sideways: driven, from commanded", sideways.truth.driven, sideways.command.driven, STRAIGHT)
        yield _share("sideways: odometry, from true", sideways.odometry.driven, sideways.truth.driven, SLIP)
    square = trials["square"]
    gap = square.odometry.end.distance(square.truth.end)
    yield DriveCheck("square: odometry's end from the true", gap, ends * square.command.driven, "m")
    most = max(trial.tilt for trial in trials.values())
    yield DriveCheck(
        "driving: leans at most", math.degrees(most), math.degrees(TILT), "deg", "lower its mass, or its limits"
    )


def _share(name: str, value: float, right: float, limit: float, advice: str = "") -> DriveCheck:
    """Return a check of the deviation from the correct value, in percent of it."""
    return DriveCheck(name, 100 * abs(value - right) / max(abs(right), 1e-9), 100 * limit, "%", advice)


def _degrees(angle: float) -> float:
    return abs(math.degrees(angle))


def _offset(body: RobotBody) -> str:
    """Describe the offset of the center of mass, which shifts the center of rotation of a skid-steer robot."""
    x, y, _ = body.chassis.center.tolist()
    along = f"{abs(x):.3f} m {'ahead of' if x > 0 else 'behind'}"
    across = f"{abs(y):.3f} m to the {'left' if y > 0 else 'right'} of"
    return f"its mass lies {along if abs(x) >= abs(y) else across} the middle of its wheels"


def _radius_that_fits(drive: Drive, line: Trial) -> str:
    """Return the wheel radius for which odometry would be correct."""
    radius = getattr(drive, "wheel_radius", None)
    if radius is None or line.odometry.driven <= 0:
        return ""
    return f"wheel_radius {radius:g} m: {radius * line.truth.driven / line.odometry.driven:.4g} m fits"


def _track_that_fits(drive: Drive, turn: Trial, line: Trial) -> str:
    """Return the effective track width for which odometry would be correct."""
    separation = getattr(drive, "wheel_separation", None)
    if separation is None or turn.truth.turned * turn.odometry.turned <= 0 or line.odometry.driven <= 0:
        return ""
    share = turn.odometry.turned / turn.truth.turned * line.truth.driven / line.odometry.driven
    if abs(share - 1) <= FITTING:
        return ""
    if isinstance(drive, Mecanum):
        lever = drive.wheels.lever
        return f"half track + half base x cot(roller_angle) {lever:.4g} m: {lever * share:.4g} m fits"
    if isinstance(drive, SkidSteer):
        track = separation * drive.turning_scale * share
        return f"turning_scale {drive.turning_scale:.4g}: {drive.turning_scale * share:.4g} fits (track {track:.4g} m)"
    return f"wheel_separation {separation:g} m: {separation * share:.4g} m fits"
