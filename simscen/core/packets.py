"""Rays sixteen at a time, in the layout that Embree takes and fills in: its `RTCRayHit16`."""

from __future__ import annotations

from ctypes import c_void_p
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array

if TYPE_CHECKING:
    import numpy.typing as npt

    Singles = npt.NDArray[np.float32]

WIDE = 16
"""Rays in a packet."""
_ROWS = 21
"""A packet's numbers of each ray: start, nearest, direction, time, end, mask, number, flags; then 9 of what it met."""
_END, _MASK, _MET = 8, 9, 17
_ALIGNED, _WORD = 64, 4
"""Bytes by which each packet, and of which each number, has to be."""
_ALL = 0xFFFFFFFF
TINY = 2e-18
"""Parts of directions that are nothing. To Embree any part within 1e-18 is positive, but by the signs of parts it tells
which rays of a packet go together, and whole packets whose rays part there would meet nothing."""


class Packets:
    """Room for rays: `starts` and `directions` (packets, 3, 16), and `ends` (packets, 16), which become what they meet.

    A ray that ends before it begins, as those do that fill up the last packet, is not asked.
    """

    def __init__(self, count: int) -> None:
        packets = -(-count // WIDE)
        room = np.zeros(packets * _ROWS * WIDE + _ALIGNED // _WORD, dtype=np.float32)
        rows = room[-room.ctypes.data % _ALIGNED // _WORD :][: packets * _ROWS * WIDE].reshape(packets, _ROWS, WIDE)
        words = rows.view(np.uint32)
        words[:, _MASK] = words[:, _MET:] = _ALL
        self.starts: Singles = rows[:, :3]
        self.directions: Singles = rows[:, 4:7]
        self.ends: Singles = rows[:, _END]
        self._count = count
        first, size = rows.ctypes.data, _ROWS * WIDE * _WORD
        self.addresses = [c_void_p(first + number * size) for number in range(packets)]
        """Where each packet lies."""

    def put(self, starts: Array, directions: Array, ends: float | Singles) -> None:
        """Rays that begin at `starts` (n, 3) and point along `directions` (n, 3), as far as `ends`."""
        for rows, values in ((self.starts, starts), (self.directions, directions)):
            flat = np.zeros((len(rows) * WIDE, 3), dtype=np.float32)
            flat[: self._count] = values
            rows[:] = flat.reshape(-1, WIDE, 3).swapaxes(1, 2)
        self.directions[np.abs(self.directions) < TINY] = 0.0
        last = np.full(len(self.ends) * WIDE, -1.0, dtype=np.float32)
        last[: self._count] = ends
        self.ends[:] = last.reshape(-1, WIDE)

    def distances(self) -> Singles:
        """How far each ray (n,) goes by now."""
        return self.ends.flatten()[: self._count]
