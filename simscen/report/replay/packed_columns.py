"""Numbers in few bytes: whole steps, differences to the number before, seven bits a byte. The page reads them back."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.records.trace import Ticks

INFINITE_STEPS = 2**30
"""Steps from which on a number counts as infinite; one more stands for what is no number."""

Column = list[float]
"""Where a column begins in the bytes, how many numbers it holds, and the step they are multiples of."""


class PackedColumns:
    """Columns of numbers, one after the other. `left_out` tells readers of the page what there was no room for."""

    def __init__(self) -> None:
        self.left_out: list[str] = []
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, values: "npt.ArrayLike", step: float = 1.0) -> Column:
        """Keep numbers as the nearest whole multiples of `step`; the result is what the page finds them by."""
        whole = quantize(np.asarray(values, dtype=np.float64).ravel(), step)
        data = varints(zigzag(np.diff(whole, prepend=0)))
        begin = self._size
        self._parts.append(data)
        self._size += len(data)
        return [begin, len(whole), step]

    def thinned(self, what: str, kept: int, among: int) -> None:
        """Say how many of something were kept, where that is not all."""
        if kept < among:
            self.left_out.append(f"{what}: {kept} of {among}")

    @property
    def data(self) -> bytes:
        """All columns."""
        return b"".join(self._parts)


def quantize(values: Array, step: float) -> npt.NDArray[np.int64]:
    """Whole numbers of steps; infinities are LARGEST with their sign, what is no number one more."""
    bounded = np.clip(
        np.nan_to_num(values / step, nan=0.0, posinf=INFINITE_STEPS, neginf=-INFINITE_STEPS),
        -INFINITE_STEPS,
        INFINITE_STEPS,
    )
    whole: npt.NDArray[np.int64] = np.rint(bounded).astype(np.int64)
    whole[np.isnan(values)] = INFINITE_STEPS + 1
    return whole


def zigzag(numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.uint64]:
    """0, -1, 1, -2, … as 0, 1, 2, 3, …: small numbers stay small, whatever their sign."""
    return ((numbers << 1) ^ (numbers >> 63)).astype(np.uint64)


def varints(numbers: npt.NDArray[np.uint64]) -> bytes:
    """Seven bits a byte, the lowest first; the eighth says that more follow."""
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
        follows = (sizes[long] > place + 1).astype(np.uint64) << np.uint64(7)
        out[begins[long] + place] = (low | follows).astype(np.uint8)
    return out.tobytes()


Chosen = npt.NDArray[np.int64]


def evenly_spaced(number: int, most: int) -> Chosen:
    """At most `most` of so many things, evenly spread, the first and the last among them."""
    if number <= most:
        return np.arange(number)
    return np.unique(np.rint(np.linspace(0, number - 1, max(most, 1))).astype(np.int64))


def spaced_in_time(ticks: Ticks, period: int) -> Chosen:
    """Samples that are at least `period` ticks apart, and the last before a pause: from there on nothing moved."""
    kept: list[int] = []
    last = None
    for k, tick in enumerate(ticks.tolist()):
        pause = k + 1 == len(ticks) or int(ticks[k + 1]) - tick > 2 * period
        if last is None or tick - last >= period or pause:
            kept.append(k)
            last = tick
    return np.array(kept, dtype=np.int64)


def keep_extremes(values: Array, most: int) -> Chosen:
    """At most `most` samples, such that the least and the greatest of each stretch are among them."""
    if len(values) <= most:
        return np.arange(len(values))
    stretches = np.array_split(np.arange(len(values)), max(1, most // 2))
    chosen = [(s[int(np.argmin(values[s]))], s[int(np.argmax(values[s]))]) for s in stretches]
    return np.unique(np.array(chosen).ravel())
