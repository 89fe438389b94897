"""The one thing sensors ask of a ray-casting scene."""

import math
from abc import abstractmethod
from typing import Protocol

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.packets import TINY, WIDE, Packets

Singles = npt.NDArray[np.float32]
ALL = slice(None)


class Fan:
    """Rays in one plane that all begin in one place, as those of a lidar, evenly spaced.

    It has room for what is worked out anew at each scan: where the rays begin, which way they point, and how far.
    """

    def __init__(self, first: float, increment: float, count: int) -> None:
        """Ray k points at `first` + k `increment` rad in the x-y plane; together they are no more than a full turn."""
        self.rays = Packets(count)
        """As `begin`, `turn` and `end` said; what fills up the last packet is its last ray once more."""
        angles = first + increment * np.minimum(np.arange(WIDE * len(self.rays.ends)), count - 1)
        self._first, self._increment, self._count = first, increment, count
        self._full = 2 * math.pi / increment
        self._flat = np.array((np.cos(angles), np.sin(angles)))

    def __len__(self) -> int:
        return self._count

    def at(self, pose: Pose3) -> tuple[Array, Array]:
        """Origins (n, 3) and unit directions (n, 3) of the rays of a fan whose frame is at `pose`."""
        (x, y), turn = self._flat[:, : self._count], pose.rotation()
        return np.repeat([pose.position], self._count, axis=0), np.column_stack((x, y, np.zeros_like(x))) @ turn.T

    def begin(self, x: float, y: float, z: float, packets: slice = ALL) -> None:
        """Those of some `packets` begin there."""
        self.rays.starts[packets] = np.array(((x,), (y,), (z,)), dtype=np.float32)

    def turn(self, ahead: Vector, left: Vector, packets: slice = ALL) -> None:
        """Work out the directions of some `packets` where the fan's x and y axes are `ahead` and `left`."""
        directions = self.rays.directions[packets]
        flat = self._flat if packets is ALL else self._flat[:, packets.start * WIDE : packets.stop * WIDE]
        turned = np.array((ahead, left)).T.dot(flat)
        turned[np.abs(turned) < TINY] = 0.0
        directions[:] = turned.reshape(3, -1, WIDE).swapaxes(0, 1)

    def end(self, reach: float) -> None:
        """No ray goes farther."""
        self.rays.ends[:] = reach

    def towards(self, x: float, y: float, least: float) -> list[slice]:
        """The rays whose products with a vector (x, y, any) of the fan's frame are `least` or more, and some beside."""
        far = math.hypot(x, y)
        if least > far:
            return []
        count, full = self._count, self._full
        half = math.acos(max(-1.0, least / far)) / self._increment if far > 0 else math.inf
        if 2 * half >= full:
            return [slice(0, count)]
        middle = (math.atan2(y, x) - self._first) % (2 * math.pi) / self._increment
        return [
            slice(max(0, math.floor(around - half)), math.ceil(around + half) + 1)
            for around in (middle - full, middle, middle + full)
            if around + half > -1 and around - half < count
        ]


class RayCaster(Protocol):
    """Casts rays against everything solid but the robot that asks."""

    @abstractmethod
    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """Distances (n,) in metres along unit `directions` (n, 3) from `origins` (n, 3).

        inf where nothing is hit within `reach` metres; who needs to know no more is answered sooner.

        *Given* the same geometry *then* the same distances, bit for bit, whatever was asked before.
        """
        ...

    def sweep(self, fan: Fan, pose: Pose3, reach: float) -> Array | Singles:
        """The same distances (n,) of a fan whose frame is at `pose` of its own; any beyond `reach` for nothing.

        What begins in one place is asked sooner.
        """
        return self.cast(*fan.at(pose), reach)
