"""What moves: where it is, how fast and how sure that is, at a moment."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2

WIDEST = 0.8
"""Metres by which what is not known of a place widens it at most."""
TOUCH = 0.03
"""Metres: whoever comes nearer is taken to touch."""

Mask = npt.NDArray[np.bool_]
Reals = npt.NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class Moving:
    """Things that move, as upright cylinders, in one frame and at one moment.

    `centres` (n, 2) in m, `velocities` (n, 2) in m/s, `radii` (n,) in m, `covariances` (n, 4, 4) of x, y, vx, vy in
    that order. `acceleration` in m/s² is how fast velocities may change: what is not known of them grows with it.
    """

    centres: Array
    velocities: Array
    radii: Array
    covariances: Array
    acceleration: float

    def __len__(self) -> int:
        return len(self.centres)

    def at(self, times: Array) -> Array:
        """Where they will be (n, times, 2) after `times` (m,) seconds, at constant velocity."""
        moved: Array = self.centres[:, None, :] + self.velocities[:, None, :] * times[None, :, None]
        return moved

    def deviations(self, times: Array) -> Array:
        """Standard deviation (n, times) in m of that, along the axis in which it is greatest."""
        return np.array(list(self._spreads(times))).reshape(len(self), len(times))

    def _spreads(self, times: Reals) -> Iterator[Reals]:
        """The same of one after the other, at times of any shape."""
        turned = (0.5 * self.acceleration * times**2) ** 2
        for c in self.covariances:
            xx, xv, vv = max(c[0, 0], c[1, 1]), max(c[0, 2], c[1, 3]), max(c[2, 2], c[3, 3])
            yield np.sqrt(float(xx) + 2.0 * float(xv) * times + float(vv) * times**2 + turned)

    def gap(self, x: Reals, y: Reals, times: Reals, sigmas: float = 0.0) -> Reals:
        """Metres (…,) from points (…,) to the surface of what will be nearest at `times`, which broadcast with them.

        Things are so many standard deviations wider, up to WIDEST; inf where nothing moves.
        """
        least = np.full(np.broadcast_shapes(x.shape, times.shape), np.inf, x.dtype)
        for gap, deviation in self._gaps(x, y, times):
            np.minimum(least, gap - np.minimum(sigmas * deviation, WIDEST) if sigmas else gap, out=least)
        return least

    def nearness(self, x: Reals, y: Reals, times: Reals, radius: float, kept_off: float) -> tuple[Reals, Mask]:
        """How near discs at points (…,) are to what will be nearest at `times`, and which of them touch it then.

        0 and less from so far off as is to be kept (metres, and a standard deviation of the place, up to WIDEST), 1
        where they touch.
        """
        shape = np.broadcast_shapes(x.shape, times.shape)
        nearest, touched = np.full(shape, -np.inf, x.dtype), np.zeros(shape, np.bool_)
        for gap, deviation in self._gaps(x, y, times):
            touched |= gap < radius + TOUCH
            np.maximum(nearest, (radius - gap) / np.minimum(kept_off + deviation, WIDEST), out=nearest)
        nearest += 1.0
        return nearest, touched

    def _gaps(self, x: Reals, y: Reals, times: Reals) -> Iterator[tuple[Reals, Reals]]:
        """Of each thing, the metres to its surface, and the standard deviation of its place then."""
        rows = zip(self.centres.tolist(), self.velocities.tolist(), self.radii.tolist(), strict=True)
        for ((cx, cy), (vx, vy), radius), deviation in zip(rows, self._spreads(times), strict=True):
            dx, dy = x - (cx + vx * times), y - (cy + vy * times)
            dx *= dx
            dy *= dy
            dx += dy
            np.sqrt(dx, out=dx)
            dx -= radius
            yield dx, deviation

    def near(self, x: float, y: float, reach: Array, times: Array) -> "Moving":
        """Those whose surface comes within `reach` (m,) of a point at one of the `times` (m,)."""
        if not len(self):
            return self
        places = self.at(times)
        off = np.hypot(places[:, :, 0] - x, places[:, :, 1] - y) - self.radii[:, None]
        close = (off < reach).any(axis=1)
        return self if close.all() else self.chosen(np.asarray(close))

    def seen_from(self, frame: Pose2) -> "Moving":
        """The same in another frame, which is at `frame` in this one."""
        back = frame.inverse()
        c, s = math.cos(back.yaw), math.sin(back.yaw)
        both = np.array(((c, -s, 0.0, 0.0), (s, c, 0.0, 0.0), (0.0, 0.0, c, -s), (0.0, 0.0, s, c)))
        centres, velocities = back.apply(self.centres), self.velocities @ both[:2, :2].T
        return Moving(centres, velocities, self.radii, both @ self.covariances @ both.T, self.acceleration)

    def after(self, seconds: float) -> "Moving":
        """The same so many seconds later."""
        step = np.eye(4)
        step[0, 2] = step[1, 3] = seconds
        centres, covariances = self.centres + self.velocities * seconds, step @ self.covariances @ step.T
        return Moving(centres, self.velocities, self.radii, covariances, self.acceleration)

    def chosen(self, which: Mask) -> "Moving":
        """Those of them."""
        return Moving(
            self.centres[which],
            self.velocities[which],
            self.radii[which],
            self.covariances[which],
            self.acceleration,
        )


def nothing(acceleration: float = 0.0) -> Moving:
    """Nothing moves."""
    return Moving(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 4, 4)), acceleration)


NOTHING = nothing()
