"""Check of a robot file: drive the robot in an empty world, and compare commands, odometry, and true motion."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from simscen.model.robot import Drive, Mecanum, SkidSteer
from simscen.run.robot_trials import RestingState, Trial, run_trials
from simscen.sim.body.climb_limits import ClimbLimits, compute_climb_limits
from simscen.sim.body.robot_body import RobotBody

MAX_REST_TILT_RAD, MAX_REST_HEIGHT_M, MAX_REST_DRIFT_M = math.radians(1.0), 0.002, 0.001
"""Largest values at rest: tilt, distance of the base frame from the ground, and drift in a second."""
MAX_DISTANCE_ERROR, MAX_ODOMETRY_ERROR = 0.02, 0.01
"""Largest relative errors on a line: true distance compared with the command, and odometry compared with the truth."""
MAX_HEADING_RAD, MAX_DRIVING_TILT_RAD = math.radians(2.0), math.radians(3.0)
"""Largest change of the heading on the line, and largest tilt of the base while driving."""
NEGLIGIBLE_CORRECTION = 0.005
"""Maximum relative deviation of the track width for which no correction is advised."""


class TurnLimits(NamedTuple):
    """Largest relative errors in trials with turns.

    Attributes:
        angle: True angle of the turn, compared with the commanded angle.
        odometry: Angle of the turn by odometry, compared with the true angle.
        square_end: Distance between the true end pose and the end pose by odometry, relative to the square's perimeter.
        offset: Distance from the start while turning in place, relative to the circumscribed radius.
    """

    angle: float
    odometry: float
    square_end: float
    offset: float


ROLLING_LIMITS = TurnLimits(angle=0.02, odometry=0.02, square_end=0.02, offset=0.05)
SKID_STEER_LIMITS = TurnLimits(angle=0.10, odometry=0.03, square_end=0.04, offset=0.50)
"""Limits without and with skid steering. Skid-steer turns depend on load and speed (Mandow et al., IROS 2007)."""


@dataclass(frozen=True)
class DriveCheck:
    """A measured value and its upper limit, both in `unit`.

    `advice` is a possible cause of a failed check, or a correction of the robot file; "" for none.
    """

    name: str
    value: float
    limit: float
    unit: str
    advice: str = ""

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit."""
        return self.value <= self.limit


@dataclass(frozen=True)
class RobotCheckResult:
    """Results of all checks of a robot. `climb` has the limits of the slopes and steps that the robot can climb."""

    rest: RestingState
    trials: tuple[Trial, ...]
    checks: tuple[DriveCheck, ...]
    climb: ClimbLimits

    @property
    def failed_count(self) -> int:
        """Number of failed checks."""
        return sum(not check.passed for check in self.checks)


def check_robot(body: RobotBody) -> RobotCheckResult:
    """Run all trials of a robot and check them. Raises RunError if the simulation becomes unstable."""
    rest, trials = run_trials(body)
    return RobotCheckResult(
        rest, trials, tuple(_checks(body, rest, {trial.name: trial for trial in trials})), compute_climb_limits(body)
    )


def _checks(body: RobotBody, rest: RestingState, trials: dict[str, Trial]) -> Iterator[DriveCheck]:
    """Yield all checks of a robot. `trials` are the trials by name."""
    limits = SKID_STEER_LIMITS if isinstance(body.drive, SkidSteer) else ROLLING_LIMITS
    yield DriveCheck(
        "at rest: tilt", math.degrees(rest.tilt), math.degrees(MAX_REST_TILT_RAD), "deg", "its wheels do not carry it"
    )
    yield DriveCheck("at rest: height above the ground", 1e3 * abs(rest.height), 1e3 * MAX_REST_HEIGHT_M, "mm")
    yield DriveCheck("at rest: motion within a second", 1e3 * rest.drift, 1e3 * MAX_REST_DRIFT_M, "mm")
    line = trials["line"]
    yield _deviation_check(
        "line: true distance against command", line.truth.distance, line.command.distance, MAX_DISTANCE_ERROR
    )
    heading = abs(math.degrees(line.truth.end.yaw))
    yield DriveCheck("line: heading at its end", heading, math.degrees(MAX_HEADING_RAD), "deg")
    advice = _wheel_radius_advice(body.drive, line)
    yield _deviation_check(
        "line: odometry against true distance", line.odometry.distance, line.truth.distance, MAX_ODOMETRY_ERROR, advice
    )
    turn = trials.get("turn") or trials["circle"]
    advice = _track_width_advice(body.drive, turn, line) or advice
    yield _deviation_check(
        f"{turn.name}: true angle against command", turn.truth.angle, turn.command.angle, limits.angle, advice
    )
    yield _deviation_check(
        f"{turn.name}: odometry against true angle", turn.odometry.angle, turn.truth.angle, limits.odometry, advice
    )
    if turn.name == "turn":
        offset = max(math.hypot(pose.x, pose.y) for pose in turn.truth.path)
        yield DriveCheck(
            "turn: distance from the start",
            offset,
            limits.offset * body.circumscribed_radius,
            "m",
            _offset_advice(body),
        )
    if sideways := trials.get("sideways"):
        yield _deviation_check(
            "sideways: true distance against command",
            sideways.truth.distance,
            sideways.command.distance,
            MAX_DISTANCE_ERROR,
        )
        yield _deviation_check(
            "sideways: odometry against true distance",
            sideways.odometry.distance,
            sideways.truth.distance,
            MAX_ODOMETRY_ERROR,
        )
    square = trials["square"]
    gap = square.odometry.end.distance(square.truth.end)
    yield DriveCheck("square: error of odometry at the end", gap, limits.square_end * square.command.distance, "m")
    tilt, max_tilt = math.degrees(max(trial.tilt for trial in trials.values())), math.degrees(MAX_DRIVING_TILT_RAD)
    yield DriveCheck("driving: tilt", tilt, max_tilt, "deg", "lower its center of mass, or its acceleration limits")


def _deviation_check(name: str, value: float, expected: float, limit: float, advice: str = "") -> DriveCheck:
    """Return a check of the relative deviation of `value` from `expected` in percent; `limit` is a ratio."""
    return DriveCheck(name, 100 * abs(value - expected) / max(abs(expected), 1e-9), 100 * limit, "%", advice)


def _offset_advice(body: RobotBody) -> str:
    """Return a message about the offset of the center of mass from the center of the wheels."""
    x, y, _ = body.chassis.center.tolist()
    longitudinal = f"{abs(x):.3f} m {'ahead of' if x > 0 else 'behind'}"
    lateral = f"{abs(y):.3f} m to the {'left' if y > 0 else 'right'} of"
    return f"its center of mass is {longitudinal if abs(x) >= abs(y) else lateral} the center of its wheels"


def _wheel_radius_advice(drive: Drive, line: Trial) -> str:
    """Return a message with the wheel radius that makes odometry correct, or "" if it is unknown."""
    radius = getattr(drive, "wheel_radius", None)
    if radius is None or line.odometry.distance <= 0:
        return ""
    return f"wheel_radius {radius:g} m: {radius * line.truth.distance / line.odometry.distance:.4g} m fits"


def _track_width_advice(drive: Drive, turn: Trial, line: Trial) -> str:
    """Return a message with the track width that makes odometry correct, or "" if it is correct or unknown."""
    separation = getattr(drive, "wheel_separation", None)
    if separation is None or turn.truth.angle * turn.odometry.angle <= 0 or line.odometry.distance <= 0:
        return ""
    ratio = turn.odometry.angle / turn.truth.angle * line.truth.distance / line.odometry.distance
    if abs(ratio - 1) <= NEGLIGIBLE_CORRECTION:
        return ""
    if isinstance(drive, Mecanum):
        lever = drive.wheels.lever
        return f"half track + half base x cot(roller_angle) {lever:.4g} m: {lever * ratio:.4g} m fits"
    if isinstance(drive, SkidSteer):
        track = separation * drive.turning_scale * ratio
        return f"turning_scale {drive.turning_scale:.4g}: {drive.turning_scale * ratio:.4g} fits (track {track:.4g} m)"
    return f"wheel_separation {separation:g} m: {separation * ratio:.4g} m fits"
