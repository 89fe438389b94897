"""Trial drives of a robot in an empty world, with its commanded motion, odometry, and true motion."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.records.case import SINGLE_ROBOT_NAME
from simscen.run.robot_interface import robot_model
from simscen.sensors.odometry import integrate_arc, kinematics_of
from simscen.sim.body.robot_body import RobotBody
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
    """A motion from the origin along the poses of `path`.

    `distance` is the driven distance in m. `angle` is the sum of all rotations in rad, counterclockwise.
    """

    distance: float
    angle: float
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
    """Drive a line, a turn in place, and a square; return the state at rest before the trials, and all trials.

    An Ackermann robot drives a circle instead of the turn. A holonomic robot also drives sideways.

    Raises RunError if the simulation becomes unstable.
    """
    simulation = Simulation(
        merge_solids([]), [], {SINGLE_ROBOT_NAME: RobotPlacement(body, Pose2(0.0, 0.0, 0.0))}, triangulate
    )
    try:
        rest = _measure_rest(simulation)
        return rest, tuple(_run_trial(simulation, body, name, legs) for name, legs in _legs_by_trial(body).items())
    finally:
        simulation.close()


def _legs_by_trial(body: RobotBody) -> dict[str, list[_TrialLeg]]:
    """Return the legs of each trial by the name of the trial."""
    model = robot_model(body)
    radius = CIRCLE_RADIUS_FACTOR * model.turning_radius
    circle, corner = (_TrialLeg(turn * radius, 0.0, turn) for turn in (2 * math.pi, math.pi / 2))
    trials = {
        "line": [_TrialLeg(LINE_LENGTH_M)],
        "circle" if radius else "turn": [circle],
        "square": [_TrialLeg(SQUARE_SIDE_M), corner] * 4,
    }
    return trials | ({"sideways": [_TrialLeg(0.0, LINE_LENGTH_M)]} if model.holonomic else {})


def _measure_rest(simulation: Simulation) -> RestingState:
    robot = simulation.robots[SINGLE_ROBOT_NAME]
    begin = robot.base_pose()
    simulation.step(REST_TICKS)
    end = robot.base_pose()
    return RestingState(_tilt(end, Pose3()), end.z, math.hypot(end.x - begin.x, end.y - begin.y))


def _run_trial(simulation: Simulation, body: RobotBody, name: str, legs: list[_TrialLeg]) -> Trial:
    robot = simulation.robots[SINGLE_ROBOT_NAME]
    simulation.place_robot(SINGLE_ROBOT_NAME, Pose2(0.0, 0.0, 0.0))
    simulation.step(SETTLING_TICKS)
    motion, level = kinematics_of(body.drive), robot.base_pose()
    encoders, start, max_tilt = robot.encoders(), level.plane, 0.0
    origin = Pose2(0.0, 0.0, 0.0)
    commanded, odometry, truth = [origin], [origin], [origin]
    for twist in (twist for leg in legs for twist in _commands(leg, body)):
        robot.drive(twist)
        simulation.step(COMMAND_PERIOD_TICKS)
        commanded.append(commanded[-1].compose(integrate_arc(Twist(*(part / FIRMWARE_RATE_HZ for part in twist)))))
        new_encoders = robot.encoders()
        step = motion(tuple(b - a for a, b in zip(encoders, new_encoders, strict=True)))
        encoders = new_encoders
        odometry.append(odometry[-1].compose(integrate_arc(step)))
        pose = robot.base_pose()
        truth.append(start.between(pose.plane))
        max_tilt = max(max_tilt, _tilt(pose, level))
    robot.truth()  # raises RunError if the simulation became unstable
    return Trial(name, _to_motion(commanded), _to_motion(odometry), _to_motion(truth), max_tilt)


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


def _to_motion(path: list[Pose2]) -> Motion:
    distance = angle = 0.0
    for pose, next_pose in pairwise(path):
        distance += pose.distance(next_pose)
        angle += wrap(next_pose.yaw - pose.yaw)
    return Motion(distance, angle, tuple(path))


def _tilt(pose: Pose3, level: Pose3) -> float:
    """Return the angle in rad between the z axes of two poses (small angles)."""
    return math.dist(_lean(pose), _lean(level))


def _lean(pose: Pose3) -> tuple[float, float]:
    """Return the angles in rad by which the z axis leans forward and to the left (small angles)."""
    x, y, z, w = pose.quaternion
    return 2 * (w * y - z * x), -2 * (w * x + y * z)
