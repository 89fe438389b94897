"""Things that were parked far away from everything else: no map reaches there, and no robot either."""

from collections.abc import Mapping

import numpy as np

from simscen.core.geometry import Array
from simscen.worlds.maps.map_size import too_large

FEW = 0.05
"""Share of the things in a world that may be outliers; where more are, it is the world that is large."""


def outliers(extents: Mapping[str, Array]) -> dict[str, float]:
    """The things to leave out for the others to fit on a map, and how many meters they lie off the middle.

    `extents` are the corners (2, 2) of what each covers in plan. Empty when all fit, or when too many do not.
    """
    names, corners = list(extents), np.array(list(extents.values())).reshape(-1, 2, 2)
    centers = corners.mean(axis=1)
    distance = np.hypot(*(centers - np.median(centers, axis=0)).T) if names else np.empty(0)
    order = np.argsort(distance, kind="stable")[::-1]
    for count in range(int(FEW * len(names)) + 2):
        kept = corners[order[count:]]
        if len(kept) == 0:
            break
        left, bottom = kept[:, 0].min(axis=0).tolist()
        right, top = kept[:, 1].max(axis=0).tolist()
        if too_large((left, bottom, right, top)) is None:
            return {names[k]: float(distance[k]) for k in order[:count]}
    return {}
