"""People who walk about a floor."""

import numpy as np

from simscen.core.geometry import Array
from simscen.study.indoor.building import Building
from simscen.study.indoor.seeing import WALKING

WANDERS = 2.5
"""m: how far from the middle of a room people who are in it walk, and from the corridor's middle never."""


def people_in(floor: Building, count: int, seconds: float, people: int, chance: np.random.Generator) -> Array:
    """Poses (count, people, 3), `seconds` apart: half of them up and down the corridor, the others about in rooms.

    Nobody gets out of the robot's way, and they walk through furniture.
    """
    times = np.arange(count) * seconds
    corridor = float(np.median(floor.doors[:, 1]))
    tracks = []
    for person in range(people):
        if person % 2:
            ends = np.array([[2.0, corridor], [floor.size[0] - 2.0, corridor]]) + chance.normal(0, 0.2, (2, 2))
        else:
            middle = floor.rooms[chance.integers(len(floor.rooms))]
            ends = middle + chance.uniform(-WANDERS, WANDERS, (2, 2)) / 2
        apart = float(np.hypot(*(ends[1] - ends[0])))
        walked = times * WALKING * chance.uniform(0.4, 1.2) + chance.uniform(0, 2 * apart)
        back = walked % (2 * apart) > apart
        along = np.abs(walked % (2 * apart) - 2 * apart * back)
        heading = np.arctan2(*(ends[1] - ends[0])[::-1]) + np.pi * back
        places = ends[0] + np.outer(along / apart, ends[1] - ends[0])
        tracks.append(np.column_stack((places, heading)))
    return np.stack(tracks, axis=1)
