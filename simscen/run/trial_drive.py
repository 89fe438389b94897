"""Drive a robot in an empty world and record commands, odometry, and truth."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.robot import Ackermann
from simscen.run.robot_interface import robot_model
from simscen.sensors.odometry import integrate_arc, kinematics_of
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.simulation import FIRMWARE_RATE_HZ
from simscen.sim.single_robot import SingleRobotSimulation
from simscen.worlds.geometry.triangulation import merge_solids, triangulate

TICK_RATE = 240
COMMAND_PERIOD = TICK_RATE // FIRMWARE_RATE_HZ
"""Ticks between two commands; the robot reaches each velocity before the next command."""
REST_TICKS, SETTLING_TICKS = 240, 60
"""Ticks at rest before the first trial and after each leg."""
LINE_LENGTH_M, SQUARE_SIDE_M = 2.0, 1.0
"""Lengths of the straight line and of a side of the square."""
MAX_SPEED_M_S, MAX_TURN_RATE_RAD_S = 0.5, 1.0
"""Largest speeds in m/s and rad/s; at most SPEED_FRACTION of the robot's limits."""
SPEED_FRACTION, ACCELERATION_FRACTION = 0.8, 0.5
"""Fractions of the robot's limits of speed and of acceleration."""
CIRCLE_RADIUS_FACTOR = 1.05
"""Radius of a car's circle relative to its smallest one, so that the steering can still correct."""


@dataclass(frozen=True)
class Motion:
    """A motion from the origin: distance `driven` in m, angle `turned` in rad, and the `path` of poses."""

    driven: float
    turned: float
    path: tuple[Pose2, ...]

    @property
    def end(self) -> Pose2:
        """The last pose."""
        return self.path[-1]


@dataclass(frozen=True)
class Trial:
    """One trial: the motion as commanded, by noise-free odometry, and in truth.

    `tilt` is the largest angle in rad between the base and its orientation at rest.
    """

    name: str
    command: Motion
    odometry: Motion
    truth: Motion
    tilt: float


@dataclass(frozen=True)
class RestingState:
    """State after a second at rest: `tilt` in rad, `height` of the base frame and `drift` in m."""

    tilt: float
    height: float
    drift: float


@dataclass(frozen=True)
class _Leg:
    """A motion from rest to rest: `forward` and `left` in m, and `turn` in rad counterclockwise, all at once."""

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0


def run_trials(body: RobotBody) -> tuple[RestingState, tuple[Trial, ...]]:
    """Drive a line, a full turn (a car: a circle), a square, and sideways if the base is holonomic.

    Raises RunError if the simulation becomes unstable.
    """
    simulation = SingleRobotSimulation(merge_solids([]), [], body, Pose2(0.0, 0.0, 0.0), triangulate)
    try:
        rest = _rest(simulation)
        return rest, tuple(_trial(simulation, body, name, legs) for name, legs in _trials(body).items())
    finally:
        simulation.close()


def _trials(body: RobotBody) -> dict[str, list[_Leg]]:
    radius = 0.0
    if isinstance(body.drive, Ackermann):
        radius = CIRCLE_RADIUS_FACTOR * body.drive.wheel_base / math.tan(body.drive.max_steering)
    circle, corner = (_Leg(turn * radius, 0.0, turn) for turn in (2 * math.pi, math.pi / 2))
    trials = {
        "line": [_Leg(LINE_LENGTH_M)],
        "circle" if radius else "turn": [circle],
        "square": [_Leg(SQUARE_SIDE_M), corner] * 4,
    }
    return trials | ({"sideways": [_Leg(0.0, LINE_LENGTH_M)]} if robot_model(body).holonomic else {})


def _rest(simulation: SingleRobotSimulation) -> RestingState:
    begin = simulation.base_pose()
    simulation.step(REST_TICKS)
    end = simulation.base_pose()
    return RestingState(_tilt(end, Pose3()), end.z, math.hypot(end.x - begin.x, end.y - begin.y))


def _trial(simulation: SingleRobotSimulation, body: RobotBody, name: str, legs: list[_Leg]) -> Trial:
    simulation.place_robot(Pose2(0.0, 0.0, 0.0))
    simulation.step(SETTLING_TICKS)
    motion, level = kinematics_of(body.drive), simulation.base_pose()
    encoders, start, max_tilt = simulation.encoders(), level.plane, 0.0
    commanded, odometry, truth = _MotionRecorder(), _MotionRecorder(), _MotionRecorder()
    for twist in (twist for leg in legs for twist in _commands(leg, body)):
        simulation.drive(twist)
        simulation.step(COMMAND_PERIOD)
        commanded.append(commanded.last.compose(integrate_arc(Twist(*(part / FIRMWARE_RATE_HZ for part in twist)))))
        new_encoders = simulation.encoders()
        step = motion(tuple(b - a for a, b in zip(encoders, new_encoders, strict=True)))
        encoders = new_encoders
        odometry.append(odometry.last.compose(integrate_arc(step)))
        pose = simulation.base_pose()
        truth.append(start.between(pose.plane))
        max_tilt = max(max_tilt, _tilt(pose, level))
    simulation.truth()  # raises RunError if the simulation became unstable
    return Trial(name, commanded.motion, odometry.motion, truth.motion, max_tilt)


def _commands(leg: _Leg, body: RobotBody) -> Iterator[Twist]:
    """Yield a trapezoidal velocity profile for a leg, then a stop."""
    model = robot_model(body)
    spans = [
        (
            leg.forward,
            min(MAX_SPEED_M_S, SPEED_FRACTION * model.max_linear),
            min(model.linear_acceleration, model.linear_deceleration),
        ),
        (
            leg.left,
            min(MAX_SPEED_M_S, SPEED_FRACTION * model.max_lateral),
            min(model.linear_acceleration, model.linear_deceleration),
        ),
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
    yield from [STOP] * (SETTLING_TICKS // COMMAND_PERIOD)


class _MotionRecorder:
    """Recorder of a motion."""

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
    """Return the angle in rad between the upward axes of two poses."""
    return math.dist(_lean(pose), _lean(level))


def _lean(pose: Pose3) -> tuple[float, float]:
    """Return the lean of the upward axis forward and to the left, in rad (small angles)."""
    x, y, z, w = pose.quaternion
    return 2 * (w * y - z * x), -2 * (w * x + y * z)
