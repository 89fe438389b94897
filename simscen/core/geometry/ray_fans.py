"""Rays in packets of sixteen as Embree takes them (`RTCRayHit16`), fans of lidar rays, and the ray-caster protocol."""

from __future__ import annotations

import math
from abc import abstractmethod
from ctypes import c_void_p
from typing import Protocol

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose3, Vector

Singles = npt.NDArray[np.float32]

PACKET_SIZE = 16
"""Rays in a packet."""
_ROWS = 21
"""A packet's numbers of each ray: start, nearest, direction, time, end, mask, number, flags; then 9 of what it met."""
_END, _MASK, _MET = 8, 9, 17
_ALIGNED, _WORD = 64, 4
"""Bytes by which each packet, and of which each number, has to be."""
_ALL = 0xFFFFFFFF
MIN_DIRECTION_COMPONENT = 2e-18
"""Parts of directions that are nothing. To Embree any part within 1e-18 is positive, but by the signs of parts it tells
which rays of a packet go together, and whole packets whose rays part there would meet nothing."""


class RayPackets:
    """Room for rays: `starts` and `directions` (packets, 3, 16), and `ends` (packets, 16), which become what they meet.

    A ray that ends before it begins, as those do that fill up the last packet, is not asked.
    """

    def __init__(self, count: int) -> None:
        packets = -(-count // PACKET_SIZE)
        room = np.zeros(packets * _ROWS * PACKET_SIZE + _ALIGNED // _WORD, dtype=np.float32)
        rows = room[-room.ctypes.data % _ALIGNED // _WORD :][: packets * _ROWS * PACKET_SIZE].reshape(
            packets, _ROWS, PACKET_SIZE
        )
        words = rows.view(np.uint32)
        words[:, _MASK] = words[:, _MET:] = _ALL
        self.starts: Singles = rows[:, :3]
        self.directions: Singles = rows[:, 4:7]
        self.ends: Singles = rows[:, _END]
        self._count = count
        first, size = rows.ctypes.data, _ROWS * PACKET_SIZE * _WORD
        self.addresses = [c_void_p(first + number * size) for number in range(packets)]
        """Where each packet lies."""

    def put(self, starts: Array, directions: Array, ends: float | Singles) -> None:
        """Rays that begin at `starts` (n, 3) and point along `directions` (n, 3), as far as `ends`."""
        for rows, values in ((self.starts, starts), (self.directions, directions)):
            flat = np.zeros((len(rows) * PACKET_SIZE, 3), dtype=np.float32)
            flat[: self._count] = values
            rows[:] = flat.reshape(-1, PACKET_SIZE, 3).swapaxes(1, 2)
        self.directions[np.abs(self.directions) < MIN_DIRECTION_COMPONENT] = 0.0
        last = np.full(len(self.ends) * PACKET_SIZE, -1.0, dtype=np.float32)
        last[: self._count] = ends
        self.ends[:] = last.reshape(-1, PACKET_SIZE)

    def distances(self) -> Singles:
        """How far each ray (n,) goes by now."""
        return self.ends.flatten()[: self._count]


ALL_PACKETS = slice(None)


class RayFan:
    """Rays in one plane that all begin in one place, as those of a lidar, evenly spaced.

    It has room for what is worked out anew at each scan: where the rays begin, which way they point, and how far.
    """

    def __init__(self, first: float, increment: float, count: int) -> None:
        """Ray k points at `first` + k `increment` rad in the x-y plane; together they are no more than a full turn."""
        self.rays = RayPackets(count)
        """As `begin`, `turn` and `end` said; what fills up the last packet is its last ray once more."""
        angles = first + increment * np.minimum(np.arange(PACKET_SIZE * len(self.rays.ends)), count - 1)
        self._first, self._increment, self._count = first, increment, count
        self._full = 2 * math.pi / increment
        self._flat = np.array((np.cos(angles), np.sin(angles)))

    def __len__(self) -> int:
        return self._count

    def at(self, pose: Pose3) -> tuple[Array, Array]:
        """Origins (n, 3) and unit directions (n, 3) of the rays of a fan whose frame is at `pose`."""
        (x, y), turn = self._flat[:, : self._count], pose.rotation()
        return np.repeat([pose.position], self._count, axis=0), np.column_stack((x, y, np.zeros_like(x))) @ turn.T

    def begin(self, x: float, y: float, z: float, packets: slice = ALL_PACKETS) -> None:
        """Those of some `packets` begin there."""
        self.rays.starts[packets] = np.array(((x,), (y,), (z,)), dtype=np.float32)

    def turn(self, ahead: Vector, left: Vector, packets: slice = ALL_PACKETS) -> None:
        """Work out the directions of some `packets` where the fan's x and y axes are `ahead` and `left`."""
        directions = self.rays.directions[packets]
        flat = (
            self._flat
            if packets is ALL_PACKETS
            else self._flat[:, packets.start * PACKET_SIZE : packets.stop * PACKET_SIZE]
        )
        turned = np.array((ahead, left)).T.dot(flat)
        turned[np.abs(turned) < MIN_DIRECTION_COMPONENT] = 0.0
        directions[:] = turned.reshape(3, -1, PACKET_SIZE).swapaxes(0, 1)

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
        """Distances (n,) in meters along unit `directions` (n, 3) from `origins` (n, 3).

        inf where nothing is hit within `reach` meters; who needs to know no more is answered sooner.

        *Given* the same geometry *then* the same distances, bit for bit, whatever was asked before.
        """
        ...

    def sweep(self, fan: RayFan, pose: Pose3, reach: float) -> Array | Singles:
        """The same distances (n,) of a fan whose frame is at `pose` of its own; any beyond `reach` for nothing.

        What begins in one place is asked sooner.
        """
        return self.cast(*fan.at(pose), reach)
