"""Motion models of MPPI (nav2_mppi_controller): simulate n control sequences at once.

Controls and velocities are arrays (axes, steps, n) of float32. The axes are vx, wz, and for a holonomic base vy. `dt`
is the time step in s.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.model.mppi import Mppi as MppiSpec
from simscen.stack.controllers.path_follower import DEFAULT_SPEED_M_S
from simscen.stack.kinematics import Axes, VelocityLimits, accumulate_rows, velocity_limits
from simscen.stack.protocols import RobotModel

Floats = npt.NDArray[np.float32]
"""Array of 32-bit floats."""
VX, WZ, VY = 0, 1, 2
"""Indices of the axes of a control sequence: forward, turn rate, and sideways."""


@dataclass(frozen=True, eq=False)
class Rollouts:
    """Simulated trajectories of n control sequences.

    x, y:        positions (steps, n) in m, relative to the position of the robot, along the axes of the costmap's frame
    yaw:         headings (steps, n) in rad in the costmap's frame
    velocities:  velocities (axes, steps, n)
    """

    x: Floats
    y: Floats
    yaw: Floats
    velocities: Floats

    @property
    def speed(self) -> Floats:
        """Absolute speed (steps, n) in m/s."""
        if len(self.velocities) <= VY:
            return np.asarray(np.abs(self.velocities[VX]))
        return np.asarray(np.hypot(self.velocities[VX], self.velocities[VY]))


def predict_velocities(current: Floats, controls: Floats, limits: VelocityLimits, dt: float) -> Floats:
    """Return the velocities of the base: `current` (axes,) at the first step, then the control of the previous step.

    Only accelerations are limited. As in Nav2, ConstraintCritic penalizes velocities beyond the limits.
    """
    velocities = np.empty_like(controls)
    velocities[:, 0] = current[:, None]
    increase, decrease = in_sequence_order(limits.acceleration) * dt, in_sequence_order(limits.deceleration) * dt
    changes = zip(increase.astype(np.float32), decrease.astype(np.float32), strict=True)
    for axis, requested, (up, down) in zip(velocities, controls, changes, strict=False):
        if down == -up:
            _limit_changes(axis, requested, up)
        else:
            _limit_asymmetric_changes(axis, requested, up, down)
    return velocities


def _limit_changes(velocities: Floats, requested: Floats, change: np.float32) -> None:
    """Set the velocities of one axis (steps, n) to `requested`, with a change of at most `change` per step."""
    bound = np.empty_like(velocities[0])
    for (last, now), target in zip(pairwise(velocities), requested, strict=False):
        np.maximum(target, np.subtract(last, change, out=bound), out=now)
        np.minimum(now, np.add(last, change, out=bound), out=now)


def _limit_asymmetric_changes(velocities: Floats, requested: Floats, up: np.float32, down: np.float32) -> None:
    """Do the same as `_limit_changes`, if acceleration (`up`) and deceleration (`down`) have different limits."""
    bound, forward = np.empty_like(velocities[0]), np.empty(velocities[0].shape, np.bool_)
    lowest, highest = np.array((-up, down)), np.array((-down, up))
    for (last, now), target in zip(pairwise(velocities), requested, strict=False):
        sign = np.greater(last, 0.0, out=forward).view(np.uint8)
        np.add(lowest.take(sign, out=bound, mode="clip"), last, out=bound)
        np.maximum(target, bound, out=now)
        np.add(highest.take(sign, out=bound, mode="clip"), last, out=bound)
        np.minimum(now, bound, out=now)


def integrate_velocities(velocities: Floats, yaw: float, dt: float) -> Rollouts:
    """Return the rollouts of these velocities, with the initial heading `yaw`. Headings are constant within a step."""
    step, (steps, count) = np.float32(dt), velocities.shape[1:]
    headings = np.empty((steps + 1, count), np.float32)
    headings[0], end_headings = 0.0, headings[1:]
    accumulate_rows(np.multiply(velocities[WZ], step, out=end_headings))
    headings += np.float32(yaw)
    cosine, sine = np.cos(headings[:-1]), np.sin(headings[:-1])
    dx, dy = velocities[VX] * cosine, velocities[VX] * sine
    if len(velocities) > VY:
        dx -= velocities[VY] * sine
        dy += velocities[VY] * cosine
    dx *= step
    dy *= step
    return Rollouts(accumulate_rows(dx), accumulate_rows(dy), end_headings, velocities)


def apply_model_delay(velocities: Floats, sent: Floats, steps: tuple[int, ...]) -> None:
    """Delay velocities in place. `steps` is the delay of each axis in time steps.

    At time step k, an axis with the delay d follows control k - d instead of k - 1. For k < d, the axis follows the
    previous commands `sent` (axes, m).
    """
    for axis, earlier, delay in zip(velocities, sent, steps, strict=False):
        if delay:
            axis[delay:] = axis[1 : max(1, len(axis) - delay + 1)].copy()
            axis[1:delay] = earlier[-delay:][1 : len(axis), None]


def mppi_limits(spec: MppiSpec, robot: RobotModel, full_speed: float) -> VelocityLimits:
    """Return the limits of the specification, bounded by the robot's limits. `full_speed` is the maximum vx in m/s."""
    lateral = DEFAULT_SPEED_M_S if spec.vy_max is None else spec.vy_max
    return velocity_limits(
        robot,
        low=(spec.vx_min, -lateral, -spec.wz_max),
        high=(full_speed, lateral, spec.wz_max),
        acceleration=(spec.ax_max, spec.ay_max, spec.az_max),
        deceleration=(spec.ax_min, spec.ay_min, None if spec.az_max is None else -spec.az_max),
        turning_radius=spec.min_turning_r,
    )


def in_sequence_order(axes: Axes) -> Array:
    """Return values for vx, vy, wz in the order of a control sequence: vx, wz, vy."""
    vx, vy, wz = axes
    return np.array((vx, wz, vy))
