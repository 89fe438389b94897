"""Moving obstacles with uncertain position and velocity, and predictions of their motion.

Vectors in the plane are complex numbers x + iy.
"""

import cmath
import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2

MAX_INFLATION_M = 0.8
"""Maximum distance by which an obstacle is inflated: for its uncertainty, and in `nearness` also for the margin."""
MAX_STEP_S, MIN_STEP_S = 0.5, 0.05
"""Maximum time step of `is_surely_clear` near an obstacle, and time step below which the result is uncertain."""
CONTACT_DISTANCE_M = 0.03
"""Distance below which a disc and an obstacle count as in contact."""

Mask = npt.NDArray[np.bool_]
Reals = npt.NDArray[np.floating]
"""Array of 32-bit or 64-bit floats."""


class MovingObstacle(NamedTuple):
    """A moving upright cylinder: position of its axis in m, velocity in m/s, and radius in m.

    The uncertainty is the same along x and y. The variances, and the `covariance` of position and velocity, are along
    one axis.
    """

    position: complex
    velocity: complex
    radius: float
    position_variance: float
    covariance: float
    velocity_variance: float

    def position_std(self, seconds: float, acceleration: float) -> float:
        """Return the standard deviation in m of the position after `seconds`.

        `acceleration` is the standard deviation of the acceleration in m/s².
        """
        *_, variance, covariance, velocity_variance = self
        drift = 0.5 * acceleration * seconds * seconds
        return math.sqrt(variance + seconds * (2.0 * covariance + velocity_variance * seconds) + drift * drift)

    def min_distance(self, start: complex, speed: float, seconds: float) -> float:
        """Return the smallest possible distance in m, within `seconds`, to a point that leaves `start` at `speed`.

        The point can move in any direction. The distance is negative if the point can get into the obstacle.
        """
        offset, velocity = self.position - start, self.velocity
        obstacle_speed = abs(velocity)
        if speed >= obstacle_speed:
            time = seconds
        else:  # the distance has its minimum between the closest approach to `start` and the end of the time
            product = offset.conjugate() * velocity
            along, across = product.real / obstacle_speed, abs(product.imag) / obstacle_speed
            lead = across * speed / math.sqrt(obstacle_speed * obstacle_speed - speed * speed)
            time = (lead - along) / obstacle_speed
            time = min(max(0.0, time), seconds)
        return abs(offset + velocity * time) - self.radius - speed * time


class MovingObstacles:
    """Moving obstacles in one frame at one time. The parameter `times` of the methods is in s after this time.

    `acceleration` is the standard deviation of the obstacles' acceleration in m/s². Because of it, the uncertainty of
    their positions grows with time.
    """

    __slots__ = ("acceleration", "obstacles")

    def __init__(self, obstacles: Iterable[MovingObstacle], acceleration: float) -> None:
        self.obstacles, self.acceleration = tuple(obstacles), acceleration

    def __len__(self) -> int:
        return len(self.obstacles)

    @property
    def centers(self) -> Array:
        """Centers (n, 2) in m."""
        return np.array([(each.position.real, each.position.imag) for each in self.obstacles]).reshape(-1, 2)

    @property
    def velocities(self) -> Array:
        """Velocities (n, 2) in m/s."""
        return np.array([(each.velocity.real, each.velocity.imag) for each in self.obstacles]).reshape(-1, 2)

    @property
    def radii(self) -> Array:
        """Radii (n,) in m."""
        return np.array([each.radius for each in self.obstacles])

    @property
    def covariances(self) -> Array:
        """Covariances (n, 4, 4) of (x, y, vx, vy)."""
        spreads = [
            ((position, covariance), (covariance, velocity)) for *_, position, covariance, velocity in self.obstacles
        ]
        return np.kron(np.array(spreads).reshape(-1, 2, 2), np.eye(2))

    def at(self, times: Array) -> Array:
        """Return the centers (m, n, 2) after `times` (m,) in s, at constant velocity."""
        moved: Array = self.centers + self.velocities * times[:, None, None]
        return moved

    def gap(self, x: Reals, y: Reals, times: Reals, sigmas: float = 0.0) -> Reals:
        """Return distances (…,) in m from points (…,) to the surface of the nearest obstacle at `times`.

        `times` broadcast with the points. Obstacles are inflated by `sigmas` standard deviations of their position, at
        most by MAX_INFLATION_M. Without obstacles, the distance is inf.
        """
        nearest = np.full(np.broadcast_shapes(x.shape, times.shape), np.inf, x.dtype)
        for obstacle, gap in self._gaps(x, y, times):
            inflation = np.minimum(sigmas * self._position_std(obstacle, times), MAX_INFLATION_M) if sigmas else 0.0
            np.minimum(nearest, gap - inflation, out=nearest)
        return nearest

    def nearness(self, x: Reals, y: Reals, times: Reals, radius: float, margin: float) -> tuple[Reals, Mask]:
        """Return the nearness (…,) of discs at points (…,) to the nearest obstacle, and whether any is in contact.

        The nearness falls linearly with the distance at `times`. It is 1 at contact, 0 at `margin` m plus one standard
        deviation of the obstacle's position (at most at MAX_INFLATION_M), and negative farther away.
        """
        shape = np.broadcast_shapes(x.shape, times.shape)
        nearness, in_contact = np.full(shape, -np.inf, x.dtype), np.zeros(shape, np.bool_)
        for obstacle, gap in self._gaps(x, y, times):
            in_contact |= gap < radius + CONTACT_DISTANCE_M
            inflation = np.minimum(margin + self._position_std(obstacle, times), MAX_INFLATION_M)
            np.maximum(nearness, (radius - gap) / inflation, out=nearness)
        nearness += 1.0
        return nearness, in_contact

    def is_surely_clear(
        self, position: Callable[[float], complex], speed: float, radius: float, margin: float, seconds: float
    ) -> bool:
        """Return True if the `nearness` of a moving disc is certainly at most 0 for `seconds`; False if uncertain.

        After t s, the disc is at `position(t)`, x + iy in m. The disc is never faster than `speed` m/s.
        """
        for obstacle in self.obstacles:
            closing_speed, time = max(speed + abs(obstacle.velocity), 1e-3), 0.0
            while time < seconds:
                offset = abs(obstacle.position + obstacle.velocity * time - position(time))
                inflation = min(
                    margin + obstacle.position_std(min(time + MAX_STEP_S, seconds), self.acceleration),
                    MAX_INFLATION_M,
                )
                slack = (offset - obstacle.radius - radius - inflation) / closing_speed
                if slack < MIN_STEP_S:
                    return False
                # `inflation` is valid for MAX_STEP_S. A longer step must assume the maximum inflation.
                time += max(min(slack, MAX_STEP_S), slack - (MAX_INFLATION_M - inflation) / closing_speed)
        return True

    def _position_std(self, obstacle: MovingObstacle, times: Reals) -> Reals:
        """Return the standard deviation (…,) in m of an obstacle's predicted position along one axis."""
        drift = (0.5 * self.acceleration * times**2) ** 2
        *_, variance, covariance, velocity_variance = obstacle
        return np.asarray(np.sqrt(variance + 2.0 * covariance * times + velocity_variance * times**2 + drift))

    def _gaps(self, x: Reals, y: Reals, times: Reals) -> Iterator[tuple[MovingObstacle, Reals]]:
        """Yield each obstacle, with the distances (…,) in m from points (…,) to the obstacle's surface at `times`."""
        for obstacle in self.obstacles:
            position, velocity, radius, *_ = obstacle
            dx, dy = x - (position.real + velocity.real * times), y - (position.imag + velocity.imag * times)
            dx *= dx
            dy *= dy
            dx += dy
            np.sqrt(dx, out=dx)
            dx -= radius
            yield obstacle, dx

    def near(self, x: float, y: float, reach: float, speed: float, seconds: float) -> "MovingObstacles":
        """Return the obstacles that can get closer than `reach` m to a robot within the next `seconds`.

        The robot moves from (x, y) at `speed` in any direction.
        """
        start = complex(x, y)
        reachable = [each for each in self.obstacles if each.min_distance(start, speed, seconds) < reach]
        return self if len(reachable) == len(self.obstacles) else MovingObstacles(reachable, self.acceleration)

    def in_frame(self, frame: Pose2) -> "MovingObstacles":
        """Return the obstacles in another frame. `frame` is the pose of the other frame in the current frame."""
        origin, turn = complex(frame.x, frame.y), cmath.rect(1.0, -frame.yaw)
        return MovingObstacles(
            [
                MovingObstacle((position - origin) * turn, velocity * turn, *radius_and_variances)
                for position, velocity, *radius_and_variances in self.obstacles
            ],
            self.acceleration,
        )

    def after(self, seconds: float) -> "MovingObstacles":
        """Return the obstacles with the states predicted after `seconds`."""
        speed_change = self.acceleration * seconds
        drift = 0.5 * speed_change * seconds
        predicted = [
            MovingObstacle(
                position + velocity * seconds,
                velocity,
                radius,
                variance + seconds * (2.0 * covariance + seconds * velocity_variance) + drift * drift,
                covariance + seconds * velocity_variance + drift * speed_change,
                velocity_variance + speed_change * speed_change,
            )
            for position, velocity, radius, variance, covariance, velocity_variance in self.obstacles
        ]
        return MovingObstacles(predicted, self.acceleration)


NO_MOVING_OBSTACLES = MovingObstacles((), 0.0)
