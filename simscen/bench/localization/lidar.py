"""People who walk about a floor."""

from dataclasses import dataclass

import numpy as np

from simscen.bench.localization.buildings import HEIGHT, Building
from simscen.core.geometry import Array
from simscen.core.geometry.shapes import TriangleMesh
from simscen.model.robot import Lidar
from simscen.worlds.raycasting.ray_scene import RayScene

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


LEG, STRIDE = 0.07, 0.14
"""m: the radius of a leg, and how far legs are from the middle between them."""
WALKING = 1.1
"""m/s."""
THROUGH = 0.8
"""Share of the beams that go through glass."""


@dataclass(frozen=True, eq=False)
class Sight:
    """What there is to see: without glass and with it."""

    opaque: RayScene
    all: RayScene

    @classmethod
    def of(cls, opaque: TriangleMesh, everything: TriangleMesh) -> "Sight":
        """Of two meshes."""
        return cls(RayScene(opaque), RayScene(everything))

    def distances(self, poses: Array, angles: Array, reach: float, chance: np.random.Generator) -> Array:
        """True ranges (n, b) from `poses` (n, 3) of the lidar along `angles` (b,); inf beyond `reach`."""
        heading = (poses[:, 2:] + angles).ravel()
        origins = np.column_stack((np.repeat(poses[:, :2], len(angles), axis=0), np.full(len(heading), HEIGHT / 2)))
        directions = np.column_stack((np.cos(heading), np.sin(heading), np.zeros(len(heading))))
        seen, behind = (scene.cast(origins, directions, reach) for scene in (self.all, self.opaque))
        through = chance.random(len(heading)) < THROUGH
        distances: Array = np.where(through, behind, seen).reshape(len(poses), len(angles))
        return distances


def angles_of(spec: Lidar) -> Array:
    """Directions (b,) of the beams in the lidar's frame."""
    full = spec.field_of_view >= 2 * np.pi - 1e-9
    increment = spec.field_of_view / (spec.beams if full else spec.beams - 1)
    angles: Array = -spec.field_of_view / 2 + increment * np.arange(spec.beams, dtype=np.float64)
    return angles


def hidden_by(people: Array, poses: Array, angles: Array, ranges: Array) -> Array:
    """Ranges (n, b) where `people` (n, p, 3) x, y, heading stand in the way of beams from `poses` (n, 3)."""
    aside = np.stack((-np.sin(people[..., 2]), np.cos(people[..., 2])), axis=-1) * STRIDE
    legs = np.concatenate((people[..., :2] + aside, people[..., :2] - aside), axis=1) - poses[:, None, :2]
    heading = poses[:, 2:] + angles
    c, s = np.cos(heading), np.sin(heading)
    seen: Array = np.array(ranges)
    for leg in range(legs.shape[1]):
        x, y = legs[:, leg, :1], legs[:, leg, 1:]
        near = np.hypot(x, y)[:, 0] < 15.0
        ahead = c[near] * x[near] + s[near] * y[near]
        inside = LEG**2 - np.square(x[near]) - np.square(y[near]) + np.square(ahead)
        hit = np.where((inside >= 0) & (ahead > 0), ahead - np.sqrt(np.maximum(inside, 0)), np.inf)
        seen[near] = np.minimum(seen[near], np.where(hit > 0, hit, np.inf))
    return seen


def measured(distances: Array, spec: Lidar, chance: np.random.Generator) -> Array:
    """What the electronics make of true distances: the simulator's lidar."""
    ranges: Array = (
        np.round((distances + chance.normal(0, spec.noise, distances.shape)) / spec.resolution) * spec.resolution
    )
    ranges[ranges > spec.max_range] = np.inf
    ranges[ranges < spec.min_range] = np.nan
    return ranges
