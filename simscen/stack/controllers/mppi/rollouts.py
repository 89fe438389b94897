"""Motion models of MPPI: rollouts of many control sequences (nav2_mppi_controller).

Controls and velocities are arrays (axes, steps, n) of float32, the axes being vx, wz and, of a base that strafes, vy.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.model.mppi import Mppi as MppiSpec
from simscen.stack.controllers.cumulative_sum import accumulate_rows
from simscen.stack.controllers.path_follower import DEFAULT_SPEED_M_S
from simscen.stack.controllers.velocity_limits import Axes, VelocityLimits, velocity_limits
from simscen.stack.protocols import RobotModel

Floats = npt.NDArray[np.float32]
VX, WZ, VY = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Rollouts:
    """Trajectories (steps, n): meters from the robot in the unrotated frame, headings, velocities (axes, steps, n)."""

    x: Floats
    y: Floats
    yaw: Floats
    velocities: Floats

    @property
    def speed(self) -> Floats:
        """m/s (steps, n), whichever way."""
        if len(self.velocities) <= VY:
            return np.asarray(np.abs(self.velocities[VX]))
        return np.asarray(np.hypot(self.velocities[VX], self.velocities[VY]))


def predict_velocities(now: Floats, controls: Floats, limits: VelocityLimits, dt: float) -> Floats:
    """Velocities that follow: the one of `now` (axes,), then each after the control of the step before it.

    Bounded by the accelerations but, as in Nav2, not by the speeds: those are ConstraintCritic's.
    """
    velocities = np.empty_like(controls)
    velocities[:, 0] = now[:, None]
    faster, slower = axis_order(limits.acceleration) * dt, axis_order(limits.deceleration) * dt
    changes = zip(faster.astype(np.float32), slower.astype(np.float32), strict=True)
    for here, asked, (up, down) in zip(velocities, controls, changes, strict=False):
        if down == -up:
            _followed(here, asked, up)
        else:
            _followed_braking(here, asked, up, down)
    return velocities


def _followed(velocities: Floats, asked: Floats, change: np.float32) -> None:
    """One axis (steps, n), in place, whose changes have one bound; no array is made on the way."""
    bound = np.empty_like(velocities[0])
    for (last, here), wanted in zip(pairwise(velocities), asked, strict=False):
        np.maximum(wanted, np.subtract(last, change, out=bound), out=here)
        np.minimum(here, np.add(last, change, out=bound), out=here)


def _followed_braking(velocities: Floats, asked: Floats, up: np.float32, down: np.float32) -> None:
    """Limit the changes of one axis whose deceleration differs from its acceleration, in place."""
    bound, forward = np.empty_like(velocities[0]), np.empty(velocities[0].shape, np.bool_)
    at_least, at_most = np.array((-up, down)), np.array((-down, up))
    for (last, here), wanted in zip(pairwise(velocities), asked, strict=False):
        sign = np.greater(last, 0.0, out=forward).view(np.uint8)
        np.add(at_least.take(sign, out=bound, mode="clip"), last, out=bound)
        np.maximum(wanted, bound, out=here)
        np.add(at_most.take(sign, out=bound, mode="clip"), last, out=bound)
        np.minimum(here, bound, out=here)


def integrate_velocities(velocities: Floats, yaw: float, dt: float) -> Rollouts:
    """Return the rollouts of these velocities from a heading; each step keeps its initial heading."""
    step, (steps, count) = np.float32(dt), velocities.shape[1:]
    headings = np.empty((steps + 1, count), np.float32)
    headings[0], turned = 0.0, headings[1:]
    accumulate_rows(np.multiply(velocities[WZ], step, out=turned))
    headings += np.float32(yaw)
    cosine, sine = np.cos(headings[:-1]), np.sin(headings[:-1])
    dx, dy = velocities[VX] * cosine, velocities[VX] * sine
    if len(velocities) > VY:
        dx -= velocities[VY] * sine
        dy += velocities[VY] * cosine
    dx *= step
    dy *= step
    return Rollouts(accumulate_rows(dx), accumulate_rows(dy), turned, velocities)


def apply_model_delay(velocities: Floats, sent: Floats, steps: tuple[int, ...]) -> None:
    """Let each axis answer so many steps late, in place: first comes what was `sent` (axes, m) and is under way."""
    for here, was, late in zip(velocities, sent, steps, strict=False):
        if late:
            here[late:] = here[1 : len(here) - late + 1].copy()
            here[1:late] = was[-late:][1 : len(here), None]


def mppi_limits(spec: MppiSpec, robot: RobotModel, fastest: float) -> VelocityLimits:
    """Return the limits of the specification, bounded by those of the robot."""
    sideways = DEFAULT_SPEED_M_S if spec.vy_max is None else spec.vy_max
    return velocity_limits(
        robot,
        low=(spec.vx_min, -sideways, -spec.wz_max),
        high=(fastest, sideways, spec.wz_max),
        acceleration=(spec.ax_max, spec.ay_max, spec.az_max),
        deceleration=(spec.ax_min, spec.ay_min, None if spec.az_max is None else -spec.az_max),
        turning_radius=spec.min_turning_r,
    )


def axis_order(axes: Axes) -> Array:
    """Return the values of the axes in the order of a control sequence: vx, wz, vy."""
    vx, vy, wz = axes
    return np.array((vx, wz, vy))
