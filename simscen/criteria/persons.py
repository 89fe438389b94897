"""How near the robot was to people: to their bodies, which are round."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.events import EventKind
from simscen.core.geometry import Array, wrap_array
from simscen.core.separation import separation
from simscen.criteria.signal_places import there, whereabouts
from simscen.criteria.signal_values import Asked, Unavailable, poses_of

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace

POINT = ((0.0, 0.0),)
INTIMATE, PERSONAL, SOCIAL = 0.45, 1.2, 3.6
"""m of gap below which somebody's space is entered (Hall, The hidden dimension, 1966; as in HuNavSim)."""


def persons(trace: Trace) -> dict[str, float]:
    """Everybody who ever was there, by name, and the radius of their body in metres."""
    found: dict[str, float] = {}
    for event in trace.of_kind(EventKind.OBJECT_SPAWNED):
        size = event.data.get("size")
        if event.data.get("person") and isinstance(size, list) and size and isinstance(size[0], int | float):
            found[event.name] = float(size[0])
    return found


def person_gap(trace: Trace, case: Case) -> Array:
    """Metres between the robot's hull and the nearest person at each truth sample; inf while nobody is there.

    Of a robot without a footprint its inscribed circle is the hull. Raises Unavailable where nobody ever was there.
    """
    everybody = persons(trace)
    if not everybody:
        raise Unavailable("there were no people")
    poses = poses_of(trace)
    nearest = np.full(len(poses), np.inf)
    for name, radius in sorted(everybody.items()):
        places = np.broadcast_to(whereabouts(trace, name)[:, :2], (len(poses), 2))
        gap = _gap(poses, places, case) - radius
        nearest = np.minimum(nearest, np.where(there(trace, name), np.maximum(gap, 0.0), np.inf))
    return nearest


def person_distance(asked: Asked) -> Array:
    """The same as a signal."""
    return person_gap(asked.trace, asked.case)


def _gap(poses: Array, places: Array, case: Case) -> Array:
    """From the hull of a robot at `poses` (n, 3) to points (n, 2)."""
    off = places - poses[:, :2]
    if len(case.footprint) < 3:
        circle: Array = np.hypot(off[:, 0], off[:, 1]) - case.inscribed_radius
        return circle
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    seen = np.stack((c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0], wrap_array(-poses[:, 2])), axis=1)
    return separation(seen, POINT, case.footprint)
