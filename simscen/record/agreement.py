"""Whether two runs that may differ in their last bits, as those of two machines do, went the same way."""

import numpy as np

from simscen.core.records.trace import Trace

TOLERANCE = 1e-5
"""m and rad by which true poses may differ. Without fused multiply-add they differ by less than 1e-12 after 90 s."""


def first_disagreement(one: Trace, other: Trace) -> str | None:
    """The first tick at which the true poses are not the same within TOLERANCE, as a sentence; None: there is none."""
    if one.tick_rate != other.tick_rate:
        return f"tick rate: {one.tick_rate} against {other.tick_rate} Hz"
    both = min(len(one.truth.ticks), len(other.truth.ticks))
    apart = np.abs(one.truth.values[:both] - other.truth.values[:both])
    apart[:, 2] = np.minimum(apart[:, 2], np.abs(2 * np.pi - apart[:, 2]))
    wrong = np.flatnonzero((one.truth.ticks[:both] != other.truth.ticks[:both]) | ~(apart <= TOLERANCE).all(axis=1))
    if len(wrong):
        tick = int(one.truth.ticks[wrong[0]])
        x, y, yaw = apart[wrong[0]].tolist()
        when = f"tick {tick} (t = {one.seconds(tick):.3f} s)"
        return f"{when}: the true pose differs by {x:.2g} m, {y:.2g} m, {yaw:.2g} rad"
    if one.end != other.end:
        return f"the runs end at ticks {one.end} and {other.end}"
    return None
