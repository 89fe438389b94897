"""Compact encoding of arrays of numbers for the replay page, and selection of samples to limit the page size.

Numbers are rounded to multiples of a step. The differences between successive numbers are stored as zigzag varints, as
in Protocol Buffers.
"""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.records.trace import Ticks

INFINITE_STEPS = 2**30
"""Code for infinity, as a number of steps. INFINITE_STEPS + 1 is the code for nan."""

Column = list[float]
"""Reference to an encoded array: offset of the first byte, number of elements, and step."""


class PackedColumns:
    """Collects encoded arrays. `reductions` are notes on data that the page contains only in part."""

    def __init__(self) -> None:
        self.reductions: list[str] = []
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, values: "npt.ArrayLike", step: float = 1.0) -> Column:
        """Add the numbers of an array in C order, rounded to multiples of `step`, and return a reference."""
        steps = quantize(np.asarray(values, dtype=np.float64).ravel(), step)
        data = varints(zigzag(np.diff(steps, prepend=0)))
        start = self._size
        self._parts.append(data)
        self._size += len(data)
        return [start, len(steps), step]

    def note_reduction(self, name: str, count: int, total: int) -> None:
        """Add a note to `reductions` if only `count` of `total` items are on the page."""
        if count < total:
            self.reductions.append(f"{name}: {count} of {total}")

    @property
    def data(self) -> bytes:
        """The bytes of all arrays, one after the other."""
        return b"".join(self._parts)


def quantize(values: Array, step: float) -> npt.NDArray[np.int64]:
    """Return the values divided by `step` and rounded; ±INFINITE_STEPS for ±inf, INFINITE_STEPS + 1 for nan."""
    bounded = np.clip(
        np.nan_to_num(values / step, nan=0.0, posinf=INFINITE_STEPS, neginf=-INFINITE_STEPS),
        -INFINITE_STEPS,
        INFINITE_STEPS,
    )
    steps: npt.NDArray[np.int64] = np.rint(bounded).astype(np.int64)
    steps[np.isnan(values)] = INFINITE_STEPS + 1
    return steps


def zigzag(numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.uint64]:
    """Map 0, -1, 1, -2, … to 0, 1, 2, 3, …"""
    return ((numbers << 1) ^ (numbers >> 63)).astype(np.uint64)


def varints(numbers: npt.NDArray[np.uint64]) -> bytes:
    """Encode numbers with seven bits per byte, lowest first; the eighth bit marks that more bytes follow."""
    if not len(numbers):
        return b""
    sizes = np.ones(len(numbers), dtype=np.int64)
    for bits in range(7, 63, 7):
        sizes += numbers >= np.uint64(1 << bits)
    begins = np.cumsum(sizes) - sizes
    out = np.empty(int(sizes.sum()), dtype=np.uint8)
    for place in range(int(sizes.max())):
        long = sizes > place
        low = (numbers[long] >> np.uint64(7 * place)) & np.uint64(0x7F)
        continuation = (sizes[long] > place + 1).astype(np.uint64) << np.uint64(7)
        out[begins[long] + place] = (low | continuation).astype(np.uint8)
    return out.tobytes()


Indices = npt.NDArray[np.int64]
"""Sorted indices of samples."""


def evenly_spaced_indices(count: int, max_count: int) -> Indices:
    """Return at most `max_count` evenly spaced indices below `count`, including the first and the last."""
    if count <= max_count:
        return np.arange(count)
    return np.unique(np.rint(np.linspace(0, count - 1, max(max_count, 1))).astype(np.int64))


def indices_spaced_in_time(ticks: Ticks, period: int) -> Indices:
    """Return the indices of samples that are at least `period` ticks apart.

    The last sample, and the last sample before a gap of more than two periods, are included as well.
    """
    indices: list[int] = []
    last = None
    for k, tick in enumerate(ticks.tolist()):
        is_before_gap = k + 1 == len(ticks) or int(ticks[k + 1]) - tick > 2 * period
        if last is None or tick - last >= period or is_before_gap:
            indices.append(k)
            last = tick
    return np.array(indices, dtype=np.int64)


def extreme_indices(values: Array, max_count: int) -> Indices:
    """Return the indices of at most `max_count` samples: minimum and maximum of each of several equal segments."""
    if len(values) <= max_count:
        return np.arange(len(values))
    segments = np.array_split(np.arange(len(values)), max(1, max_count // 2))
    extremes = [(s[int(np.argmin(values[s]))], s[int(np.argmax(values[s]))]) for s in segments]
    return np.unique(np.array(extremes).ravel())
