"""Control sequences of MPPI: weights of samples (noisy copies), smoothing, limits, and shift in time.

A control sequence is an array (axes, steps) of velocities. The axes are vx, wz, and for a holonomic base vy.
"""

from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array
from simscen.stack.controllers.mppi.rollouts import VX, WZ, Floats, in_sequence_order
from simscen.stack.kinematics import VelocityLimits

SMOOTHING_KERNELS = {
    1: np.full(9, 1.0 / 9.0, np.float32),
    2: np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21], np.float32) / np.float32(231.0),
}
"""Savitzky-Golay filters of nine points by the order of their polynomial (Savitzky and Golay 1964)."""
MIN_SMOOTHED_STEPS = 21
"""Minimum length of a control sequence to be smoothed."""
PAST_COMMANDS = 4
"""Number of previous commands that a filter of nine points needs to smooth the first step."""


def sample_weights(
    costs: Array, sequence: Floats, noise: Floats, deviations: Sequence[float], gamma: float, temperature: float
) -> Floats:
    """Return the weights (n,) of samples, proportional to exp(-total cost / temperature).

    `noise` (axes, steps, n) was added to the sequence. `deviations` are the standard deviations of the noise by axis.
    The total cost is the cost in `costs` (n,) plus the control cost: `gamma` times the product of sequence and noise,
    divided by the variance.
    """
    total = costs.copy()
    for axis, deviation in enumerate(deviations):
        if deviation > 0.0:
            total += gamma / deviation**2 * (sequence[axis] @ noise[axis])
    weights = np.exp((total.min() - total) / temperature)
    return np.asarray(weights / weights.sum(), np.float32)


def smooth_sequence(sequence: Floats, past: Floats, order: int) -> Floats:
    """Return the sequence, smoothed except for the last step. `past` (axes, 4) are the commands before the sequence.

    `order` is a key of SMOOTHING_KERNELS.
    """
    if sequence.shape[1] < MIN_SMOOTHED_STEPS:
        return sequence
    padded = np.concatenate((past, sequence, np.repeat(sequence[:, -1:], PAST_COMMANDS, axis=1)), axis=1)
    result: Floats = sequence.copy()
    for axis, row in enumerate(padded):
        result[axis, :-1] = np.convolve(row, SMOOTHING_KERNELS[order], mode="valid")[:-1]
    return result


def apply_limits(sequence: Floats, current: Floats, limits: VelocityLimits, dt: float) -> Floats:
    """Return the sequence within velocity and acceleration limits. The first step is the velocity `current` (axes,).

    Modifies `sequence`. `dt` is the time step in s.
    """
    low, high = in_sequence_order(limits.low).tolist(), in_sequence_order(limits.high).tolist()
    increase = (in_sequence_order(limits.acceleration) * dt).tolist()
    decrease = (in_sequence_order(limits.deceleration) * dt).tolist()
    _limit_curvature(sequence, limits)
    result = np.empty_like(sequence)
    for axis in range(len(sequence)):
        result[axis] = _limit_axis(
            sequence[axis].tolist(), float(current[axis]), (low[axis], high[axis]), (increase[axis], decrease[axis])
        )
    _limit_curvature(result, limits)
    return result


def _limit_axis(
    requested: list[float], current: float, bounds: tuple[float, float], speed_changes: tuple[float, float]
) -> list[float]:
    """Return the velocities of one axis within `bounds` (low, high).

    In each step, the speed rises by at most `speed_changes[0]`, and falls by at most `-speed_changes[1]`.
    """
    (low, high), (up, down) = bounds, speed_changes
    limited, last = [current], current
    for velocity in requested[1:]:
        target = low if velocity < low else min(velocity, high)
        lowest, highest = (last + down, last + up) if last >= 0.0 else (last - up, last - down)
        last = lowest if target < lowest else highest if target > highest else target
        limited.append(last)
    return limited


def _limit_curvature(sequence: Floats, limits: VelocityLimits) -> None:
    """Limit the turn rates of a car to its turning radius, in place."""
    if limits.turning_radius > 0.0:
        max_turn_rate = np.abs(sequence[VX]) / np.float32(limits.turning_radius)
        np.clip(sequence[WZ], -max_turn_rate, max_turn_rate, out=sequence[WZ])


def shift_sequence(sequence: Floats, steps: float) -> Floats:
    """Return the sequence, shifted by `steps` with linear interpolation. The last value is repeated."""
    index = np.arange(sequence.shape[1], dtype=np.float64)
    return np.stack([np.interp(index + steps, index, row) for row in sequence]).astype(np.float32)
