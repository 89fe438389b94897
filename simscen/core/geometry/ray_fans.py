"""Rays: interface of ray casters, fans of rays such as the beams of a lidar, and buffers for the ray tracer Embree.

Embree casts rays in packets of 16 (`RTCRayHit16`).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from ctypes import c_void_p
from typing import Protocol

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose3, Vector

Float32Array = npt.NDArray[np.float32]

PACKET_SIZE = 16
"""Number of rays per packet."""
_ROWS = 21
"""Number of rows of a packet. Each row contains one value of all 16 rays.

Rows: start (3), minimum length, direction (3), time, maximum length, mask, id, flags, and 9 values of the hit.
"""
_LENGTH_ROW, _MASK_ROW, _HIT_ID_ROW = 8, 9, 17
"""Row of the maximum length, row of the mask, and first row of the ids of the hit geometry."""
_PACKET_ALIGNMENT, _VALUE_BYTES = 64, 4
"""Alignment of packets, and size of values, in bytes."""
_ALL_BITS = 0xFFFFFFFF
"""Mask of a ray that hits all geometries, and id of the hit geometry if nothing was hit."""
MIN_DIRECTION_COMPONENT = 2e-18
"""Smaller components of directions are set to 0, because Embree misses hits of rays with such tiny components."""


class RayPackets:
    """Buffer of `count` rays for Embree: `starts` and `directions` (packets, 3, 16), and `lengths` (packets, 16).

    `lengths` are the maximum lengths of the rays in m. Embree replaces the maximum length with the distance of the hit.
    """

    def __init__(self, count: int) -> None:
        packets = -(-count // PACKET_SIZE)
        buffer = np.zeros(packets * _ROWS * PACKET_SIZE + _PACKET_ALIGNMENT // _VALUE_BYTES, dtype=np.float32)
        rows = buffer[-buffer.ctypes.data % _PACKET_ALIGNMENT // _VALUE_BYTES :][
            : packets * _ROWS * PACKET_SIZE
        ].reshape(packets, _ROWS, PACKET_SIZE)
        words = rows.view(np.uint32)
        words[:, _MASK_ROW] = words[:, _HIT_ID_ROW:] = _ALL_BITS
        self.starts: Float32Array = rows[:, :3]
        self.directions: Float32Array = rows[:, 4:7]
        self.lengths: Float32Array = rows[:, _LENGTH_ROW]
        self._count = count
        first, size = rows.ctypes.data, _ROWS * PACKET_SIZE * _VALUE_BYTES
        self.addresses = [c_void_p(first + number * size) for number in range(packets)]
        """Address of each packet."""

    def set_rays(self, starts: Array, directions: Array, lengths: float | Float32Array) -> None:
        """Set the start points (n, 3), the directions (n, 3), and the maximum lengths (n,) of all rays."""
        for rows, values in ((self.starts, starts), (self.directions, directions)):
            flat = np.zeros((len(rows) * PACKET_SIZE, 3), dtype=np.float32)
            flat[: self._count] = values
            rows[:] = flat.reshape(-1, PACKET_SIZE, 3).swapaxes(1, 2)
        self.directions[np.abs(self.directions) < MIN_DIRECTION_COMPONENT] = 0.0
        padded = np.full(len(self.lengths) * PACKET_SIZE, -1.0, dtype=np.float32)  # Embree skips negative lengths
        padded[: self._count] = lengths
        self.lengths[:] = padded.reshape(-1, PACKET_SIZE)

    def distances(self) -> Float32Array:
        """Return the distance (n,) in m of the hit of each ray; the maximum length of the ray if it hits nothing.

        Call this after Embree has cast the rays.
        """
        return self.lengths.flatten()[: self._count]


ALL_PACKETS = slice(None)
"""Index of all packets of a fan."""


class RayFan:
    """Evenly spaced rays in one plane with a common origin, such as the beams of a lidar."""

    def __init__(self, first: float, increment: float, count: int) -> None:
        """Create `count` rays. Ray k has the direction `first` + k `increment` (rad) in the x-y plane."""
        self.rays = RayPackets(count)
        """Buffer of the rays. Copies of the last ray fill the last packet."""
        angles = first + increment * np.minimum(np.arange(PACKET_SIZE * len(self.rays.lengths)), count - 1)
        self._first, self._increment, self._count = first, increment, count
        self._turn = 2 * math.pi / increment  # a full turn in increments
        self._flat = np.array((np.cos(angles), np.sin(angles)))

    def __len__(self) -> int:
        return self._count

    def at(self, pose: Pose3) -> tuple[Array, Array]:
        """Return origins (n, 3) and unit directions (n, 3) of the rays if the fan is at `pose`."""
        (x, y), rotation = self._flat[:, : self._count], pose.rotation()
        return np.repeat([pose.position], self._count, axis=0), np.column_stack((x, y, np.zeros_like(x))) @ rotation.T

    def set_origin(self, x: float, y: float, z: float, packets: slice = ALL_PACKETS) -> None:
        """Set the origin (m) of the rays in the given packets."""
        self.rays.starts[packets] = np.array(((x,), (y,), (z,)), dtype=np.float32)

    def set_directions(self, forward: Vector, left: Vector, packets: slice = ALL_PACKETS) -> None:
        """Set the directions of the rays in the given packets. `forward` and `left` are the x and y axes of the fan."""
        directions = self.rays.directions[packets]
        flat = (
            self._flat
            if packets is ALL_PACKETS
            else self._flat[:, packets.start * PACKET_SIZE : packets.stop * PACKET_SIZE]
        )
        turned = np.array((forward, left)).T.dot(flat)
        turned[np.abs(turned) < MIN_DIRECTION_COMPONENT] = 0.0
        directions[:] = turned.reshape(3, -1, PACKET_SIZE).swapaxes(0, 1)

    def set_length(self, reach: float) -> None:
        """Set the maximum length of all rays in m."""
        self.rays.lengths[:] = reach

    def rays_towards(self, x: float, y: float, min_dot: float) -> list[slice]:
        """Return slices of the rays whose direction has a dot product of at least `min_dot` with (x, y).

        (x, y) is in the frame of the fan. The slices can contain a few more rays at their ends.
        """
        far = math.hypot(x, y)
        if min_dot > far:
            return []
        count, turn = self._count, self._turn
        half = math.acos(max(-1.0, min_dot / far)) / self._increment if far > 0 else math.inf
        if 2 * half >= turn:
            return [slice(0, count)]
        middle = (math.atan2(y, x) - self._first) % (2 * math.pi) / self._increment
        return [
            slice(max(0, math.floor(around - half)), math.ceil(around + half) + 1)
            for around in (middle - turn, middle, middle + turn)
            if around + half > -1 and around - half < count
        ]


class RayCaster(Protocol):
    """Computes the distances at which rays hit solids, except the robot that carries the sensor.

    The same geometry gives the same distances, bit for bit, regardless of earlier calls.
    """

    @abstractmethod
    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """Return the distances (n,) in m from `origins` (n, 3) along unit `directions` (n, 3).

        The distance is inf if nothing is hit within `reach` m.
        """

    def sweep(self, fan: RayFan, pose: Pose3, reach: float) -> Array | Float32Array:
        """Return the distances (n,) in m for the rays of a fan at `pose`. Larger values than `reach` mean no hit."""
        return self.cast(*fan.at(pose), reach)
