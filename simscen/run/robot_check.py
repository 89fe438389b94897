"""Check of a robot file: drive the robot in an empty world, and compare commands, odometry, and true motion."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.records.case import ROBOT_NAME
from simscen.model.robot import Ackermann, Drive, Mecanum, SkidSteer
from simscen.run.robot_interface import robot_model
from simscen.sensors.odometry import integrate_arc, kinematics_of
from simscen.sim.body.robot_body import ClimbLimits, RobotBody, compute_climb_limits
from simscen.sim.simulation import FIRMWARE_RATE_HZ, RobotPlacement, Simulation
from simscen.worlds.geometry.triangulation import merge_solids, triangulate

TICK_RATE_HZ = 240
COMMAND_PERIOD_TICKS = TICK_RATE_HZ // FIRMWARE_RATE_HZ
"""Ticks between two commands."""
REST_TICKS, SETTLING_TICKS = 240, 60
"""Ticks at rest before the first trial, and before each trial and after each leg."""
LINE_LENGTH_M, SQUARE_SIDE_M = 2.0, 1.0
"""Lengths of the straight line and of a side of the square."""
MAX_SPEED_M_S, MAX_TURN_RATE_RAD_S = 0.5, 1.0
"""Upper limits of the linear and angular speeds of the trials."""
SPEED_FRACTION, ACCELERATION_FRACTION = 0.8, 0.5
"""Largest speed and acceleration of the trials, as fractions of the robot's limits."""
CIRCLE_RADIUS_FACTOR = 1.05
"""Radius of the circle that an Ackermann robot drives, in multiples of its smallest turning radius."""


@dataclass(frozen=True)
class Motion:
    """A motion from the origin along the poses of `path`: distance `driven` in m, and angle `turned` in rad."""

    driven: float
    turned: float
    path: tuple[Pose2, ...]

    @property
    def end(self) -> Pose2:
        """The last pose."""
        return self.path[-1]


@dataclass(frozen=True)
class Trial:
    """One trial drive: the commanded motion, the motion by odometry without noise, and the true motion.

    `tilt` is the largest angle in rad by which the base leans while driving.
    """

    name: str
    command: Motion
    odometry: Motion
    truth: Motion
    tilt: float


@dataclass(frozen=True)
class RestingState:
    """State after one second at rest: tilt in rad, height of the base frame above the ground in m, and drift in m."""

    tilt: float
    height: float
    drift: float


@dataclass(frozen=True)
class _TrialLeg:
    """Part of a trial from rest to rest: forward (m), left (m), and turn (rad, counterclockwise) at the same time."""

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0


def run_trials(body: RobotBody) -> tuple[RestingState, tuple[Trial, ...]]:
    """Drive a line, a turn in place, and a square; return the resting state before, and all trials.

    An Ackermann robot drives a circle instead of the turn. A holonomic robot also drives sideways.

    Raises RunError if the simulation becomes unstable.
    """
    simulation = Simulation(merge_solids([]), [], {ROBOT_NAME: RobotPlacement(body, Pose2(0.0, 0.0, 0.0))}, triangulate)
    try:
        rest = _measure_rest(simulation)
        return rest, tuple(_run_trial(simulation, body, name, legs) for name, legs in _legs_by_trial(body).items())
    finally:
        simulation.close()


def _legs_by_trial(body: RobotBody) -> dict[str, list[_TrialLeg]]:
    """Return the legs of each trial by its name."""
    radius = 0.0
    if isinstance(body.drive, Ackermann):
        radius = CIRCLE_RADIUS_FACTOR * body.drive.wheel_base / math.tan(body.drive.max_steering)
    circle, corner = (_TrialLeg(turn * radius, 0.0, turn) for turn in (2 * math.pi, math.pi / 2))
    trials = {
        "line": [_TrialLeg(LINE_LENGTH_M)],
        "circle" if radius else "turn": [circle],
        "square": [_TrialLeg(SQUARE_SIDE_M), corner] * 4,
    }
    return trials | ({"sideways": [_TrialLeg(0.0, LINE_LENGTH_M)]} if robot_model(body).holonomic else {})


def _measure_rest(simulation: Simulation) -> RestingState:
    robot = simulation.robots[ROBOT_NAME]
    begin = robot.base_pose()
    simulation.step(REST_TICKS)
    end = robot.base_pose()
    return RestingState(_tilt(end, Pose3()), end.z, math.hypot(end.x - begin.x, end.y - begin.y))


def _run_trial(simulation: Simulation, body: RobotBody, name: str, legs: list[_TrialLeg]) -> Trial:
    robot = simulation.robots[ROBOT_NAME]
    simulation.place_robot(ROBOT_NAME, Pose2(0.0, 0.0, 0.0))
    simulation.step(SETTLING_TICKS)
    motion, level = kinematics_of(body.drive), robot.base_pose()
    encoders, start, max_tilt = robot.encoders(), level.plane, 0.0
    commanded, odometry, truth = _MotionRecorder(), _MotionRecorder(), _MotionRecorder()
    for twist in (twist for leg in legs for twist in _commands(leg, body)):
        robot.drive(twist)
        simulation.step(COMMAND_PERIOD_TICKS)
        commanded.append(commanded.last.compose(integrate_arc(Twist(*(part / FIRMWARE_RATE_HZ for part in twist)))))
        new_encoders = robot.encoders()
        step = motion(tuple(b - a for a, b in zip(encoders, new_encoders, strict=True)))
        encoders = new_encoders
        odometry.append(odometry.last.compose(integrate_arc(step)))
        pose = robot.base_pose()
        truth.append(start.between(pose.plane))
        max_tilt = max(max_tilt, _tilt(pose, level))
    robot.truth()  # raises RunError if the simulation became unstable
    return Trial(name, commanded.motion, odometry.motion, truth.motion, max_tilt)


def _commands(leg: _TrialLeg, body: RobotBody) -> Iterator[Twist]:
    """Yield a trapezoidal velocity profile for a leg, then a stop."""
    model = robot_model(body)
    linear_acceleration = min(model.linear_acceleration, model.linear_deceleration)
    spans = [  # distance or angle, largest speed, largest acceleration
        (leg.forward, min(MAX_SPEED_M_S, SPEED_FRACTION * model.max_linear), linear_acceleration),
        (leg.left, min(MAX_SPEED_M_S, SPEED_FRACTION * model.max_lateral), linear_acceleration),
        (leg.turn, min(MAX_TURN_RATE_RAD_S, SPEED_FRACTION * model.max_angular), model.angular_acceleration),
    ]
    rate = min(speed / abs(span) for span, speed, _ in spans if span)
    gain = (
        min(ACCELERATION_FRACTION * acceleration / abs(span) for span, _, acceleration in spans if span)
        / FIRMWARE_RATE_HZ
    )
    ramp = [gain * k for k in range(1, math.ceil(rate / gain))]
    remaining = 1.0 - 2 * sum(ramp) / FIRMWARE_RATE_HZ
    while remaining < 0:
        remaining += 2 * ramp.pop() / FIRMWARE_RATE_HZ
    cruising = math.ceil(remaining * FIRMWARE_RATE_HZ / rate)
    rates = [*ramp, *[remaining * FIRMWARE_RATE_HZ / max(1, cruising)] * cruising, *reversed(ramp)]
    yield from (Twist(leg.forward * r, leg.left * r, leg.turn * r) for r in rates)
    yield from [STOP] * (SETTLING_TICKS // COMMAND_PERIOD_TICKS)


class _MotionRecorder:
    """Collects poses from the origin on, and sums up distances and angles."""

    def __init__(self) -> None:
        self._path, self._driven, self._turned = [Pose2(0.0, 0.0, 0.0)], 0.0, 0.0

    @property
    def last(self) -> Pose2:
        return self._path[-1]

    def append(self, pose: Pose2) -> None:
        self._driven += self.last.distance(pose)
        self._turned += wrap(pose.yaw - self.last.yaw)
        self._path.append(pose)

    @property
    def motion(self) -> Motion:
        return Motion(self._driven, self._turned, tuple(self._path))


def _tilt(pose: Pose3, level: Pose3) -> float:
    """Return the angle in rad between the z axes of two poses (small angles)."""
    return math.dist(_lean(pose), _lean(level))


def _lean(pose: Pose3) -> tuple[float, float]:
    """Return the angles in rad by which the z axis leans forward and to the left (small angles)."""
    x, y, z, w = pose.quaternion
    return 2 * (w * y - z * x), -2 * (w * x + y * z)


MAX_REST_TILT_RAD, MAX_REST_HEIGHT_M, MAX_REST_DRIFT_M = math.radians(1.0), 0.002, 0.001
"""Largest values at rest: tilt, distance of the wheels from the ground, and drift in a second."""
MAX_DISTANCE_ERROR, MAX_ODOMETRY_ERROR = 0.02, 0.01
"""Largest relative errors on a line: true distance compared with the command, and odometry compared with the truth."""
MAX_HEADING_RAD, MAX_DRIVING_TILT_RAD = math.radians(2.0), math.radians(3.0)
"""Largest heading at the end of the line, and largest tilt of the base while driving."""
NEGLIGIBLE_CORRECTION = 0.005
"""Maximum relative deviation of the track width for which no correction is advised."""


class TurnLimits(NamedTuple):
    """Largest relative errors in trials with turns.

    Attributes:
        angle: True angle of the turn, compared with the commanded angle.
        odometry: Angle of the turn by odometry, compared with the true angle.
        square_end: Distance from the true end of the square to its end by odometry, relative to its length.
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
    """A measured value and its upper limit, both in `unit`. `advice` is a possible correction of the robot, or ""."""

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
    """Results of all checks of a robot. `climb` has the steepest slope and the highest step that it can climb."""

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
    limits = SKID_STEER_LIMITS if isinstance(body.drive, SkidSteer) else ROLLING_LIMITS
    yield DriveCheck(
        "at rest: leans", math.degrees(rest.tilt), math.degrees(MAX_REST_TILT_RAD), "deg", "its wheels do not carry it"
    )
    yield DriveCheck("at rest: off its wheels' ground", 1e3 * abs(rest.height), 1e3 * MAX_REST_HEIGHT_M, "mm")
    yield DriveCheck("at rest: creeps in a second", 1e3 * rest.drift, 1e3 * MAX_REST_DRIFT_M, "mm")
    line = trials["line"]
    yield _deviation_check("line: driven, from commanded", line.truth.driven, line.command.driven, MAX_DISTANCE_ERROR)
    heading = abs(math.degrees(line.truth.end.yaw))
    yield DriveCheck("line: heading at its end", heading, math.degrees(MAX_HEADING_RAD), "deg")
    advice = _wheel_radius_advice(body.drive, line)
    yield _deviation_check(
        "line: odometry, from true distance", line.odometry.driven, line.truth.driven, MAX_ODOMETRY_ERROR, advice
    )
    turn = trials.get("turn") or trials["circle"]
    advice = _track_width_advice(body.drive, turn, line) or advice
    yield _deviation_check(
        f"{turn.name}: turned, from commanded", turn.truth.turned, turn.command.turned, limits.angle, advice
    )
    yield _deviation_check(
        f"{turn.name}: odometry, from true angle", turn.odometry.turned, turn.truth.turned, limits.odometry, advice
    )
    if turn.name == "turn":
        offset = max(math.hypot(pose.x, pose.y) for pose in turn.truth.path)
        yield DriveCheck(
            "turn: off the spot", offset, limits.offset * body.circumscribed_radius, "m", _offset_advice(body)
        )
    if sideways := trials.get("sideways"):
        yield _deviation_check(
            "sideways: driven, from commanded", sideways.truth.driven, sideways.command.driven, MAX_DISTANCE_ERROR
        )
        yield _deviation_check(
            "sideways: odometry, from true", sideways.odometry.driven, sideways.truth.driven, MAX_ODOMETRY_ERROR
        )
    square = trials["square"]
    gap = square.odometry.end.distance(square.truth.end)
    yield DriveCheck("square: odometry's end from the true", gap, limits.square_end * square.command.driven, "m")
    tilt, max_tilt = math.degrees(max(trial.tilt for trial in trials.values())), math.degrees(MAX_DRIVING_TILT_RAD)
    yield DriveCheck("driving: leans at most", tilt, max_tilt, "deg", "lower its mass, or its limits")


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
    if radius is None or line.odometry.driven <= 0:
        return ""
    return f"wheel_radius {radius:g} m: {radius * line.truth.driven / line.odometry.driven:.4g} m fits"


def _track_width_advice(drive: Drive, turn: Trial, line: Trial) -> str:
    """Return a message with the track width that makes odometry correct, or "" if it is correct or unknown."""
    separation = getattr(drive, "wheel_separation", None)
    if separation is None or turn.truth.turned * turn.odometry.turned <= 0 or line.odometry.driven <= 0:
        return ""
    ratio = turn.odometry.turned / turn.truth.turned * line.truth.driven / line.odometry.driven
    if abs(ratio - 1) <= NEGLIGIBLE_CORRECTION:
        return ""
    if isinstance(drive, Mecanum):
        lever = drive.wheels.lever
        return f"half track + half base x cot(roller_angle) {lever:.4g} m: {lever * ratio:.4g} m fits"
    if isinstance(drive, SkidSteer):
        track = separation * drive.turning_scale * ratio
        return f"turning_scale {drive.turning_scale:.4g}: {drive.turning_scale * ratio:.4g} fits (track {track:.4g} m)"
    return f"wheel_separation {separation:g} m: {separation * ratio:.4g} m fits"
