"""Moving obstacles: position, velocity, and their uncertainty at one time."""

import cmath
import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2

MAX_UNCERTAINTY_M = 0.8
"""Largest inflation of an obstacle for its uncertainty."""
MAX_STEP_S, MIN_STEP_S = 0.5, 0.05
"""Longest and shortest time step of `surely_off`. Steps are longer where the distance exceeds MAX_UNCERTAINTY_M."""
CONTACT_DISTANCE_M = 0.03
"""Closer obstacles count as touching."""

Mask = npt.NDArray[np.bool_]
Reals = npt.NDArray[np.floating]


class MovingObstacle(NamedTuple):
    """A moving upright cylinder: center (m) and velocity (m/s) as x + iy, and radius in m.

    The uncertainty is isotropic: variance of the position, covariance of position and velocity, variance of the
    velocity.
    """

    place: complex
    velocity: complex
    radius: float
    place_variance: float
    covariance: float
    velocity_variance: float

    def deviation(self, seconds: float, acceleration: float) -> float:
        """Return the standard deviation in m of the position after `seconds`, with this `acceleration` in m/s²."""
        *_, variance, covariance, wanders = self
        turned = 0.5 * acceleration * seconds * seconds
        return math.sqrt(variance + seconds * (2.0 * covariance + wanders * seconds) + turned * turned)

    def missed_by(self, here: complex, speed: float, seconds: float) -> float:
        """Return a lower bound of the distance in m to anything that leaves `here` at `speed` in any direction."""
        off, velocity = self.place - here, self.velocity
        own = abs(velocity)
        if speed >= own:
            when = seconds
        else:  # the minimum lies between the closest approach to `here` and the end of the time
            along, aside = (off.conjugate() * velocity).real / own, abs((off.conjugate() * velocity).imag) / own
            when = (aside * speed / math.sqrt(own * own - speed * speed) - along) / own
            when = min(max(0.0, when), seconds)
        return abs(off + velocity * when) - self.radius - speed * when


class MovingObstacles:
    """Moving obstacles in one frame and at one time.

    `acceleration` in m/s² is the assumed change of velocity; the uncertainty of predictions grows with it.
    """

    __slots__ = ("acceleration", "things")

    def __init__(
        self, centers: Array, velocities: Array, radii: Array, covariances: Array, acceleration: float
    ) -> None:
        """Create obstacles from `centers` (n, 2) in m, `velocities` (n, 2) in m/s, and `radii` (n,) in m.

        `covariances` (n, 4, 4) are of x, y, vx, vy in that order; the larger value of the two axes is used for both.
        """
        spreads = np.maximum(covariances[:, (0, 0, 2), (0, 2, 2)], covariances[:, (1, 1, 3), (1, 3, 3)])
        rows = zip(centers.tolist(), velocities.tolist(), radii.tolist(), spreads.tolist(), strict=True)
        self.things = tuple(
            MovingObstacle(complex(*at), complex(*goes), radius, *spread) for at, goes, radius, spread in rows
        )
        self.acceleration = acceleration

    @classmethod
    def of(cls, things: Iterable[MovingObstacle], acceleration: float) -> "MovingObstacles":
        """Create a set of these obstacles."""
        moving = object.__new__(cls)
        moving.things, moving.acceleration = tuple(things), acceleration
        return moving

    def __len__(self) -> int:
        return len(self.things)

    @property
    def centers(self) -> Array:
        """Centers (n, 2) in m."""
        return np.array([(each.place.real, each.place.imag) for each in self.things]).reshape(-1, 2)

    @property
    def velocities(self) -> Array:
        """Velocities (n, 2) in m/s."""
        return np.array([(each.velocity.real, each.velocity.imag) for each in self.things]).reshape(-1, 2)

    @property
    def radii(self) -> Array:
        """Radii (n,) in m."""
        return np.array([each.radius for each in self.things])

    @property
    def covariances(self) -> Array:
        """Covariances (n, 4, 4) of x, y, vx, vy in that order."""
        spreads = [((place, both), (both, velocity)) for *_, place, both, velocity in self.things]
        return np.kron(np.array(spreads).reshape(-1, 2, 2), np.eye(2))

    def at(self, times: Array) -> Array:
        """Return the centers (m, n, 2) after `times` (m,) in s, at constant velocity."""
        moved: Array = self.centers + self.velocities * times[:, None, None]
        return moved

    def gap(self, x: Reals, y: Reals, times: Reals, sigmas: float = 0.0) -> Reals:
        """Return distances (…,) in m from points (…,) to the surface of the nearest obstacle at `times`.

        `times` broadcast with the points. Obstacles are inflated by `sigmas` standard deviations, at most by
        MAX_UNCERTAINTY_M. Without obstacles, the distance is inf.
        """
        least = np.full(np.broadcast_shapes(x.shape, times.shape), np.inf, x.dtype)
        for thing, gap in self._gaps(x, y, times):
            wider = np.minimum(sigmas * self._deviation(thing, times), MAX_UNCERTAINTY_M) if sigmas else 0.0
            np.minimum(least, gap - wider, out=least)
        return least

    def nearness(self, x: Reals, y: Reals, times: Reals, radius: float, kept_off: float) -> tuple[Reals, Mask]:
        """Return the nearness (…,) of discs at points (…,) to the nearest obstacle at `times`, and whether they touch.

        The nearness is 1 at contact and 0 at the distance `kept_off` (m) plus one standard deviation of the position,
        at most MAX_UNCERTAINTY_M; farther away it is negative.
        """
        shape = np.broadcast_shapes(x.shape, times.shape)
        nearest, touched = np.full(shape, -np.inf, x.dtype), np.zeros(shape, np.bool_)
        for thing, gap in self._gaps(x, y, times):
            touched |= gap < radius + CONTACT_DISTANCE_M
            room = np.minimum(kept_off + self._deviation(thing, times), MAX_UNCERTAINTY_M)
            np.maximum(nearest, (radius - gap) / room, out=nearest)
        nearest += 1.0
        return nearest, touched

    def surely_off(
        self, place: Callable[[float], complex], speed: float, reach: float, kept_off: float, seconds: float
    ) -> bool:
        """Return True if a disc of radius `reach` at `place(t)`, not faster than `speed`, has a nearness of at most 0.

        This is a quick check for the given time in s; False means that it could not decide.
        """
        for thing in self.things:
            closing, time = max(speed + abs(thing.velocity), 1e-3), 0.0
            while time < seconds:
                off = abs(thing.place + thing.velocity * time - place(time))
                room = min(
                    kept_off + thing.deviation(min(time + MAX_STEP_S, seconds), self.acceleration), MAX_UNCERTAINTY_M
                )
                spare = (off - thing.radius - reach - room) / closing
                if spare < MIN_STEP_S:
                    return False
                time += max(min(spare, MAX_STEP_S), spare - (MAX_UNCERTAINTY_M - room) / closing)
        return True

    def _deviation(self, thing: MovingObstacle, times: Reals) -> Reals:
        """Return the standard deviation (…,) in m of an obstacle's predicted position along any axis."""
        turned = (0.5 * self.acceleration * times**2) ** 2
        *_, variance, covariance, wanders = thing
        return np.asarray(np.sqrt(variance + 2.0 * covariance * times + wanders * times**2 + turned))

    def _gaps(self, x: Reals, y: Reals, times: Reals) -> Iterator[tuple[MovingObstacle, Reals]]:
        """Yield each obstacle with the distances (…,) in m to its surface."""
        for thing in self.things:
            place, velocity, radius, *_ = thing
            dx, dy = x - (place.real + velocity.real * times), y - (place.imag + velocity.imag * times)
            dx *= dx
            dy *= dy
            dx += dy
            np.sqrt(dx, out=dx)
            dx -= radius
            yield thing, dx

    def near(self, x: float, y: float, reach: float, speed: float, seconds: float) -> "MovingObstacles":
        """Return the obstacles that can come within `reach` m of a robot that leaves a point at `speed`."""
        here = complex(x, y)
        close = [each for each in self.things if each.missed_by(here, speed, seconds) < reach]
        return self if len(close) == len(self.things) else MovingObstacles.of(close, self.acceleration)

    def seen_from(self, frame: Pose2) -> "MovingObstacles":
        """Return the obstacles expressed in another frame, whose pose in this frame is `frame`."""
        origin, turn = complex(frame.x, frame.y), cmath.rect(1.0, -frame.yaw)
        return MovingObstacles.of(
            [MovingObstacle((place - origin) * turn, goes * turn, *rest) for place, goes, *rest in self.things],
            self.acceleration,
        )

    def after(self, seconds: float) -> "MovingObstacles":
        """Return the obstacles as predicted after `seconds`."""
        later = [
            MovingObstacle(
                place + goes * seconds,
                goes,
                radius,
                variance + seconds * (2.0 * covariance + seconds * wanders),
                covariance + seconds * wanders,
                wanders,
            )
            for place, goes, radius, variance, covariance, wanders in self.things
        ]
        return MovingObstacles.of(later, self.acceleration)


def no_moving_obstacles(acceleration: float = 0.0) -> MovingObstacles:
    """Return an empty set of obstacles."""
    return MovingObstacles.of((), acceleration)


NO_MOVING_OBSTACLES = no_moving_obstacles()
