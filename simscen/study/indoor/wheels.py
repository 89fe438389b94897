"""What raw wheel odometry says of a drive: the errors of a base that nobody calibrated, and wheels that slip."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.model.robot import WheelOdometry

STUMBLES_EACH = 25.0
"""Seconds between two stretches of slipping wheels, on average."""
STUMBLE = (0.3, 1.5)
"""Seconds that one lasts."""


@dataclass(frozen=True)
class Wheels:
    """Standard deviations, over bases, of the constant errors of dead reckoning; whether wheels slip besides.

    `scale` of distances (wheels' radius), `turn` of angles (wheel base), `bend` in rad/m (wheels of unequal size):
    Borenstein and Feng, Measurement and correction of systematic odometry errors in mobile robots, T-RA 12 (1996).
    """

    scale: float = 0.015
    turn: float = 0.03
    bend: float = 0.015
    slips: bool = True


CLEAN = Wheels(0.0, 0.0, 0.0, False)
"""Wheels with nothing but the random errors of the simulator's sensor."""


def reckoned(truth: Array, seconds: float, wheels: Wheels, spec: WheelOdometry, chance: np.random.Generator) -> Array:
    """Poses (k, 3) in the odom frame for true poses (k, 3), `seconds` apart."""
    steps = np.array([Pose2(0, 0, 0), *(a.between(b) for a, b in pairwise(Pose2(*row) for row in truth))])
    way = np.hypot(steps[:, 0], steps[:, 1])
    scale, turn, bend = (
        1 + chance.normal(0, wheels.scale),
        1 + chance.normal(0, wheels.turn),
        chance.normal(0, wheels.bend),
    )
    along, around = chance.standard_normal((2, len(steps)))
    stretch = scale * _slip(len(steps), seconds, wheels.slips, chance)
    stretch[way > 0] += spec.translation_noise * along[way > 0] / np.sqrt(way[way > 0])
    heading = np.sqrt(spec.rotation_noise**2 * np.abs(steps[:, 2]) + spec.drift_noise**2 * way)
    spun = _slip(len(steps), seconds, wheels.slips, chance)
    turned = steps[:, 2] * turn * spun + bend * way + heading * around
    poses = [Pose2(0.0, 0.0, 0.0)]
    for x, y, yaw in np.column_stack((steps[:, 0] * stretch, steps[:, 1] * stretch, turned))[1:].tolist():
        poses.append(poses[-1].compose(Pose2(x, y, yaw)))
    return np.array(poses)


def _slip(count: int, seconds: float, slips: bool, chance: np.random.Generator) -> Array:
    """How much further than the base the wheels turn (count,): 1, and for short stretches 0.9 … 1.4."""
    factor = np.ones(count)
    if not slips:
        return factor
    row = int(chance.exponential(STUMBLES_EACH) / seconds)
    while row < count:
        end = row + max(1, int(chance.uniform(*STUMBLE) / seconds))
        factor[row:end] = chance.uniform(0.9, 1.4)
        row = end + int(chance.exponential(STUMBLES_EACH) / seconds)
    return factor
