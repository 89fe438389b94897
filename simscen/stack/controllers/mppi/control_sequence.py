"""Control sequence (axes, steps) of MPPI: averaging, smoothing, limits, and shifting in time."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.stack.controllers.mppi.rollouts import VX, WZ, axis_order
from simscen.stack.controllers.velocity_limits import VelocityLimits

Floats = npt.NDArray[np.float32]
KERNELS = {
    1: np.full(9, 1.0 / 9.0, np.float32),
    2: np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21], np.float32) / np.float32(231.0),
}
"""Savitzky-Golay filters of nine points by their order (Savitzky and Golay 1964)."""
MIN_SMOOTHED_STEPS = 21
"""Steps from which on a sequence is smoothed."""
PAST_COMMANDS = 4
"""Commands of the past that the filter sees."""


def sample_weights(
    costs: Array, sequence: Floats, noise: Floats, deviations: Sequence[float], gamma: float, temperature: float
) -> Floats:
    """Return the weights of the samples (n,): exp(-cost / temperature), including the control cost.

    `noise` (axes, steps, n) of these standard deviations lies about the sequence; what it draws it away from is dear.
    """
    total = costs.copy()
    for axis, deviation in enumerate(deviations):
        if deviation > 0.0:
            total += gamma / deviation**2 * (sequence[axis] @ noise[axis])
    shares = np.exp((total.min() - total) / temperature)
    return np.asarray(shares / shares.sum(), np.float32)


def smooth_sequence(sequence: Floats, past: Floats, order: int) -> Floats:
    """Return the filtered sequence, all but its last step; `past` (axes, 4) are the commands before it."""
    if sequence.shape[1] < MIN_SMOOTHED_STEPS:
        return sequence
    wide = np.concatenate((past, sequence, np.repeat(sequence[:, -1:], PAST_COMMANDS, axis=1)), axis=1)
    result: Floats = sequence.copy()
    for axis, row in enumerate(wide):
        result[axis, :-1] = np.convolve(row, KERNELS[order], mode="valid")[:-1]
    return result


def apply_limits(sequence: Floats, now: Floats, limits: VelocityLimits, dt: float) -> Floats:
    """Return the nearest sequence that the base can drive from the velocity `now` (axes,), which is its first step."""
    low, high = axis_order(limits.low).tolist(), axis_order(limits.high).tolist()
    faster, slower = (axis_order(limits.acceleration) * dt).tolist(), (axis_order(limits.deceleration) * dt).tolist()
    _keep_to_curve(sequence, limits)
    result = np.empty_like(sequence)
    for axis in range(len(sequence)):
        result[axis] = _driveable(
            sequence[axis].tolist(), float(now[axis]), (low[axis], high[axis]), (faster[axis], slower[axis])
        )
    _keep_to_curve(result, limits)
    return result


def _driveable(
    asked: list[float], now: float, bounds: tuple[float, float], changes: tuple[float, float]
) -> list[float]:
    """One axis of it: within `bounds`, and changing by no more than so much a step, up and (negative) braking."""
    (low, high), (up, down) = bounds, changes
    found, last = [now], now
    for each in asked[1:]:
        wanted = low if each < low else min(each, high)
        least, most = (last + down, last + up) if last >= 0.0 else (last - up, last - down)
        last = least if wanted < least else most if wanted > most else wanted
        found.append(last)
    return found


def _keep_to_curve(sequence: Floats, limits: VelocityLimits) -> None:
    """Ackermann: never turn tighter than the turning radius; in place."""
    if limits.turning_radius > 0.0:
        most = np.abs(sequence[VX]) / np.float32(limits.turning_radius)
        np.clip(sequence[WZ], -most, most, out=sequence[WZ])


def shift_sequence(sequence: Floats, steps: float) -> Floats:
    """Return the sequence shifted forward by so many steps, with its last value repeated."""
    here = np.arange(sequence.shape[1], dtype=np.float64)
    return np.stack([np.interp(here + steps, here, row) for row in sequence]).astype(np.float32)
