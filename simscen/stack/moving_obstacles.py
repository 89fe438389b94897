"""What moves: where it is, how fast and how sure that is, at a moment."""

import cmath
import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2

MAX_UNCERTAINTY_M = 0.8
"""Meters by which what is not known of a place widens it at most."""
MAX_STEP_S, MIN_STEP_S = 0.5, 0.05
"""Seconds that are passed over at once at most, unless all keep clear of each other by WIDEST as well, and at least, to
be worth it."""
CONTACT_DISTANCE_M = 0.03
"""Meters: whoever comes nearer is taken to touch."""

Mask = npt.NDArray[np.bool_]
Reals = npt.NDArray[np.floating]


class MovingObstacle(NamedTuple):
    """An upright cylinder that moves: its middle (m) and its velocity (m/s) as x + iy, and its radius in m.

    How sure these are is alike along all axes: variance of the place, covariance of both, variance of the velocity.
    """

    place: complex
    velocity: complex
    radius: float
    place_variance: float
    covariance: float
    velocity_variance: float

    def deviation(self, seconds: float, acceleration: float) -> float:
        """Standard deviation in m of where it will be, along any axis, if its velocity may change so fast in m/s²."""
        *_, variance, covariance, wanders = self
        turned = 0.5 * acceleration * seconds * seconds
        return math.sqrt(variance + seconds * (2.0 * covariance + wanders * seconds) + turned * turned)

    def missed_by(self, here: complex, speed: float, seconds: float) -> float:
        """Meters at least that its surface stays off whoever leaves `here` at `speed` for so long, whichever way."""
        off, velocity = self.place - here, self.velocity
        own = abs(velocity)
        if speed >= own:
            when = seconds
        else:  # the nearer to `here`, the nearer; and the later, the farther may who left have come
            along, aside = (off.conjugate() * velocity).real / own, abs((off.conjugate() * velocity).imag) / own
            when = (aside * speed / math.sqrt(own * own - speed * speed) - along) / own
            when = min(max(0.0, when), seconds)
        return abs(off + velocity * when) - self.radius - speed * when


class MovingObstacles:
    """Things that move, as upright cylinders, in one frame and at one moment.

    `acceleration` in m/s² is how fast velocities may change: what is not known of them grows with it.
    """

    __slots__ = ("acceleration", "things")

    def __init__(
        self, centers: Array, velocities: Array, radii: Array, covariances: Array, acceleration: float
    ) -> None:
        """Of `centers` (n, 2) in m, `velocities` (n, 2) in m/s, `radii` (n,) in m.

        `covariances` (n, 4, 4) are of x, y, vx, vy in that order; of the two axes, what is known less holds for both.
        """
        spreads = np.maximum(covariances[:, (0, 0, 2), (0, 2, 2)], covariances[:, (1, 1, 3), (1, 3, 3)])
        rows = zip(centers.tolist(), velocities.tolist(), radii.tolist(), spreads.tolist(), strict=True)
        self.things = tuple(
            MovingObstacle(complex(*at), complex(*goes), radius, *spread) for at, goes, radius, spread in rows
        )
        self.acceleration = acceleration

    @classmethod
    def of(cls, things: Iterable[MovingObstacle], acceleration: float) -> "MovingObstacles":
        """These things."""
        moving = object.__new__(cls)
        moving.things, moving.acceleration = tuple(things), acceleration
        return moving

    def __len__(self) -> int:
        return len(self.things)

    @property
    def centers(self) -> Array:
        """Their middles (n, 2) in m."""
        return np.array([(each.place.real, each.place.imag) for each in self.things]).reshape(-1, 2)

    @property
    def velocities(self) -> Array:
        """The same (n, 2) in m/s."""
        return np.array([(each.velocity.real, each.velocity.imag) for each in self.things]).reshape(-1, 2)

    @property
    def radii(self) -> Array:
        """Their radii (n,) in m."""
        return np.array([each.radius for each in self.things])

    @property
    def covariances(self) -> Array:
        """How sure that is: (n, 4, 4) of x, y, vx, vy in that order."""
        spreads = [((place, both), (both, velocity)) for *_, place, both, velocity in self.things]
        return np.kron(np.array(spreads).reshape(-1, 2, 2), np.eye(2))

    def at(self, times: Array) -> Array:
        """Where their middles will be (times, n, 2) after `times` (m,) seconds, at constant velocity."""
        moved: Array = self.centers + self.velocities * times[:, None, None]
        return moved

    def gap(self, x: Reals, y: Reals, times: Reals, sigmas: float = 0.0) -> Reals:
        """Meters (…,) from points (…,) to the surface of what will be nearest at `times`, which broadcast with them.

        Things are so many standard deviations wider, up to WIDEST; inf where nothing moves.
        """
        least = np.full(np.broadcast_shapes(x.shape, times.shape), np.inf, x.dtype)
        for thing, gap in self._gaps(x, y, times):
            wider = np.minimum(sigmas * self._deviation(thing, times), MAX_UNCERTAINTY_M) if sigmas else 0.0
            np.minimum(least, gap - wider, out=least)
        return least

    def nearness(self, x: Reals, y: Reals, times: Reals, radius: float, kept_off: float) -> tuple[Reals, Mask]:
        """How near discs at points (…,) are to what will be nearest at `times`, and which of them touch it then.

        0 and less from so far off as is to be kept (meters, and a standard deviation of the place, up to WIDEST), 1
        where they touch.
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
        """Whether a disc of radius `reach` at `place(t)`, no faster than `speed`, has a `nearness` of 0 at most for so
        many seconds; False where that is not told at once.
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
        """Standard deviation (…,) in m of where one will be, along any axis."""
        turned = (0.5 * self.acceleration * times**2) ** 2
        *_, variance, covariance, wanders = thing
        return np.asarray(np.sqrt(variance + 2.0 * covariance * times + wanders * times**2 + turned))

    def _gaps(self, x: Reals, y: Reals, times: Reals) -> Iterator[tuple[MovingObstacle, Reals]]:
        """Of each thing, the meters (…,) to its surface."""
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
        """Those whose surface may come within `reach` meters of who leaves a point at `speed`, in so many seconds."""
        here = complex(x, y)
        close = [each for each in self.things if each.missed_by(here, speed, seconds) < reach]
        return self if len(close) == len(self.things) else MovingObstacles.of(close, self.acceleration)

    def seen_from(self, frame: Pose2) -> "MovingObstacles":
        """The same in another frame, which is at `frame` in this one."""
        origin, turn = complex(frame.x, frame.y), cmath.rect(1.0, -frame.yaw)
        return MovingObstacles.of(
            [MovingObstacle((place - origin) * turn, goes * turn, *rest) for place, goes, *rest in self.things],
            self.acceleration,
        )

    def after(self, seconds: float) -> "MovingObstacles":
        """The same so many seconds later."""
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
    """Nothing moves."""
    return MovingObstacles.of((), acceleration)


NO_MOVING_OBSTACLES = no_moving_obstacles()
