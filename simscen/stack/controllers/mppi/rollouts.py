"""What the base would do under thousands of control sequences: nav2_mppi_controller's motion models.

Controls and velocities are arrays (axes, steps, n) of float32, the axes being vx, wz and, of a base that strafes, vy.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.stack.controllers.limits import Limits
from simscen.stack.controllers.mppi.limits import in_order
from simscen.stack.controllers.sums import add_up

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


def predicted(now: Floats, controls: Floats, limits: Limits, dt: float) -> Floats:
    """Velocities that follow: the one of `now` (axes,), then each after the control of the step before it.

    Bounded by the accelerations but, as in Nav2, not by the speeds: those are ConstraintCritic's.
    """
    velocities = np.empty_like(controls)
    velocities[:, 0] = now[:, None]
    faster, slower = in_order(limits.acceleration) * dt, in_order(limits.deceleration) * dt
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
    """The same where the base brakes otherwise than it speeds up: which bound holds is looked up by the sign."""
    bound, forward = np.empty_like(velocities[0]), np.empty(velocities[0].shape, np.bool_)
    at_least, at_most = np.array((-up, down)), np.array((-down, up))
    for (last, here), wanted in zip(pairwise(velocities), asked, strict=False):
        sign = np.greater(last, 0.0, out=forward).view(np.uint8)
        np.add(at_least.take(sign, out=bound, mode="clip"), last, out=bound)
        np.maximum(wanted, bound, out=here)
        np.add(at_most.take(sign, out=bound, mode="clip"), last, out=bound)
        np.minimum(here, bound, out=here)


def integrated(velocities: Floats, yaw: float, dt: float) -> Rollouts:
    """Where these velocities lead from a heading; each step keeps the heading it begins with."""
    step, (steps, count) = np.float32(dt), velocities.shape[1:]
    headings = np.empty((steps + 1, count), np.float32)
    headings[0], turned = 0.0, headings[1:]
    add_up(np.multiply(velocities[WZ], step, out=turned))
    headings += np.float32(yaw)
    cosine, sine = np.cos(headings[:-1]), np.sin(headings[:-1])
    dx, dy = velocities[VX] * cosine, velocities[VX] * sine
    if len(velocities) > VY:
        dx -= velocities[VY] * sine
        dy += velocities[VY] * cosine
    dx *= step
    dy *= step
    return Rollouts(add_up(dx), add_up(dy), turned, velocities)


def delay(velocities: Floats, sent: Floats, steps: tuple[int, ...]) -> None:
    """Let each axis answer so many steps late, in place: first comes what was `sent` (axes, m) and is under way."""
    for here, was, late in zip(velocities, sent, steps, strict=False):
        if late:
            here[late:] = here[1 : len(here) - late + 1].copy()
            here[1:late] = was[-late:][1 : len(here), None]
