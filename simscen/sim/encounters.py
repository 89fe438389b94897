"""When what a script moves may meet what can be pushed: until then both can be left alone.

Bullet does not wake what a body without mass meets. So nothing that can be pushed may sleep where a scripted body
comes; elsewhere it may, which spares nearly all that it costs. Whatever else touches it wakes it in the engine, and
with it all that it is in touch with (Bullet's islands).
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Vector

HORIZON = 0.1
"""Seconds for which bounds on speeds hold: those of what may fall, or be hit, meanwhile."""
SOON = 0.05
"""Seconds within which a meeting is near: what may be met is awake by then, and every tick is stepped with care."""
ROUNDED = 0.05
"""m that shapes may extend further than their corners, which is where sizes come from."""


class Balls(NamedTuple):
    """Bodies seen from above: each within its radius (n,) in m of its place (n, 2), at most so fast, in m/s."""

    places: Array
    radii: Array
    speeds: Array

    @classmethod
    def of(cls, balls: Iterable[tuple[Vector, float, float]]) -> "Balls":
        """From place in space, radius and speed of each."""
        each = list(balls)
        places, radii, speeds = zip(*each, strict=True) if each else ((), (), ())
        return cls(np.array(places).reshape(-1, 3)[:, :2], np.array(radii), np.array(speeds))


class Encounters(NamedTuple):
    """Who may meet within `seconds`: the numbers of the scripted ones, and of those that can be pushed.

    Where nobody may meet soon, nobody can within `seconds`.
    """

    scripted: tuple[int, ...]
    pushable: tuple[int, ...]
    seconds: float


def encounters(scripted: Balls, pushable: Balls, hit: float) -> Encounters:
    """Who may meet soon; what can be pushed may get to `hit` m/s within the horizon, for something may hit it."""
    apart = np.linalg.norm(scripted.places[:, np.newaxis] - pushable.places, axis=2)
    gaps = apart - scripted.radii[:, np.newaxis] - pushable.radii - 2 * ROUNDED
    closing = scripted.speeds[:, np.newaxis] + np.maximum(pushable.speeds, hit)
    near = gaps < SOON * closing
    if near.any():
        return Encounters(_numbers(near.any(axis=1)), _numbers(near.any(axis=0)), SOON)
    return Encounters((), (), min(HORIZON, float((gaps / closing).min(initial=math.inf))))


def _numbers(chosen: npt.NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(chosen.nonzero()[0].tolist())
