"""What the base would do under thousands of control sequences: nav2_mppi_controller's motion models.

Controls and velocities are arrays (axes, steps, n) of float32, the axes being vx, wz and, of a base that strafes, vy.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.stack.controllers.mppi.limits import Limits

Floats = npt.NDArray[np.float32]
VX, WZ, VY = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Rollouts:
    """Trajectories (steps, n): metres from the robot in the unrotated frame, headings, velocities (axes, steps, n)."""

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
    axes, steps = controls.shape[:2]
    up = (limits.faster[:axes, None] * dt).astype(np.float32)
    down = (limits.slower[:axes, None] * dt).astype(np.float32)
    velocities = np.empty_like(controls)
    velocities[:, 0] = now[:, None]
    for step in range(1, steps):
        last = velocities[:, step - 1]
        forward = last > 0.0
        least, most = last + np.where(forward, down, -up), last + np.where(forward, up, -down)
        np.clip(controls[:, step - 1], least, most, out=velocities[:, step])
    return velocities


def integrated(velocities: Floats, yaw: float, dt: float) -> Rollouts:
    """Where these velocities lead from a heading; each step keeps the heading it begins with."""
    step = np.float32(dt)
    headings = np.cumsum(velocities[WZ] * step, axis=0, dtype=np.float32) + np.float32(yaw)
    before = np.concatenate((np.full((1, headings.shape[1]), yaw, np.float32), headings[:-1]))
    cosine, sine = np.cos(before), np.sin(before)
    dx, dy = velocities[VX] * cosine, velocities[VX] * sine
    if len(velocities) > VY:
        dx -= velocities[VY] * sine
        dy += velocities[VY] * cosine
    x, y = np.cumsum(dx * step, axis=0, dtype=np.float32), np.cumsum(dy * step, axis=0, dtype=np.float32)
    return Rollouts(x, y, headings, velocities)


def delay(velocities: Floats, sent: Floats, steps: tuple[int, ...]) -> None:
    """Let each axis answer so many steps late, in place: first comes what was `sent` (axes, m) and is under way."""
    for here, was, late in zip(velocities, sent, steps, strict=False):
        if late:
            here[late:] = here[1 : len(here) - late + 1].copy()
            here[1:late] = was[-late:][1 : len(here), None]
