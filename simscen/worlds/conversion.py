"""Convert imported worlds (SDF) to the obstacles and objects of a world file."""

import math
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain, count, pairwise
from typing import TypeVar

import numpy as np
from pydantic import ValidationError

from simscen.core.environment.world_model import World
from simscen.core.geometry import wrap
from simscen.core.geometry.motion_paths import pose_at
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.model.world import Movable, Obstacle, Travel, WorldSpec
from simscen.worlds.extent import placed_solids
from simscen.worlds.prism_shapes import DECIMALS, PrismShape, first_problem, first_reason, prism_shapes

MAX_NAME_LENGTH = 120
"""Maximum number of characters of a name in a world file. Longer names are cut."""
STRAIGHT_TOLERANCE_RAD = 1e-6
"""Maximum change of direction at a point where a path does not turn."""

ObjectT = TypeVar("ObjectT", Obstacle, Movable)


@dataclass
class Conversion:
    """Obstacles and objects for a world file. `changes` has a sentence for each difference from the imported world."""

    obstacles: list[Obstacle] = field(default_factory=list)
    objects: list[Movable] = field(default_factory=list)
    changes: list[str] = field(default_factory=list)
    _names: set[str] = field(default_factory=set, init=False)

    def add(self, kind: type[ObjectT], items: list[ObjectT], fields: dict[str, object]) -> None:
        """Build an obstacle or object (`kind`) from `fields`, and add it to `items`.

        If the fields are not valid, add a sentence to `changes` instead. A repeated name gets a number: `shelf-2`.
        """
        name = self._unique_name(str(fields["name"])[:MAX_NAME_LENGTH] or "obstacle")
        try:
            items.append(kind.model_validate({**fields, "name": name}))
        except ValidationError as error:
            self.changes.append(f"{name}: {first_problem(error)}; it is left out")
        else:
            self._names.add(name)

    def _unique_name(self, name: str) -> str:
        suffixes = chain([""], (f"-{number}" for number in count(2)))
        names = (f"{name[: MAX_NAME_LENGTH - len(suffix)]}{suffix}" for suffix in suffixes)
        return next(candidate for candidate in names if candidate not in self._names)

    def merged_into(self, spec: WorldSpec) -> WorldSpec:
        """Return a copy of `spec` without `sdf`, with these obstacles and objects before the ones of `spec`.

        Raises pydantic.ValidationError if there are more obstacles or objects than a world file may have.
        """
        return WorldSpec.model_validate(
            {
                **spec.model_dump(exclude_unset=True),
                "sdf": None,
                "obstacles": [*self.obstacles, *spec.obstacles],
                "objects": [*self.objects, *spec.objects],
            }
        )


def convert_world(world: World, height: float) -> Conversion:
    """Convert the solids of a world to obstacles, and its bodies to objects (obstacles if they have several shapes).

    `height` in m is the height of the cross sections of solids that are replaced by prisms (see `prism_shapes`). Solids
    and bodies that cannot be converted are left out, with a sentence in `changes`.
    """
    conversion = Conversion()
    for solid in world.solids:
        friction = {"friction": solid.friction} if solid.friction != 1.0 else {}
        for shape in prism_shapes(solid, height, conversion.changes):
            conversion.add(Obstacle, conversion.obstacles, {"name": solid.name, **shape.fields, **friction})
    for body in world.bodies:
        _add_body(body, height, conversion)
    return conversion


def _add_body(body: Body, height: float, conversion: Conversion) -> None:
    """Add the body as an object; or as obstacles if it has several shapes, because an object has only one shape."""
    solids = placed_solids((), [body])
    shapes = [shape for solid in solids for shape in prism_shapes(solid, height, conversion.changes)]
    if not shapes:
        return
    if len(shapes) > 1:
        moves = "moved" if body.path else "could be pushed" if body.mass else "could be moved"
        conversion.changes.append(
            f"{body.name}: it {moves} and has {len(shapes)} shapes, but an object has only one shape; it is made static"
        )
        for shape in shapes:
            conversion.add(Obstacle, conversion.obstacles, {"name": body.name, **shape.fields})
        return
    travel = _travel(body.name, body.path, shapes[0], conversion.changes) if body.path else None
    fields = {"name": body.name, "mass": body.mass, "move": travel, **shapes[0].fields}
    conversion.add(Movable, conversion.objects, fields)


def _travel(name: str, path: MotionPath, shape: PrismShape, changes: list[str]) -> Travel | None:
    """Return the scripted motion of a body; None with a sentence in `changes` if the motion cannot be converted.

    The motion has waypoints if the body moves along straight lines with a constant speed, otherwise keyframes. `shape`
    is the shape of the body `name` at its initial pose.
    """
    start, is_round = shape.pose, shape.radius is not None
    if waypoints := _waypoints(path):
        speed = sum(a.distance(b) for a, b in pairwise(path.poses)) / path.times[-1]
        by_waypoints = {"through": waypoints, "speed": speed, "repeat": path.mode, "start": path.start}
        with suppress(ValidationError):  # keyframes may still describe the motion
            travel = Travel.model_validate(by_waypoints)
            if _are_same_motion(travel.path(start, path.start), path, is_round):
                return travel
    first = pose_at(path, 0.0)
    if start.distance(first) > 10**-DECIMALS or not (is_round or abs(wrap(start.yaw - first.yaw)) < 10**-DECIMALS):
        changes.append(f"{name}: it moves, but its shape is not at its origin; it is made static")
        return None
    frames = [[time, *np.round(pose, DECIMALS).tolist()] for time, pose in zip(path.times, path.poses, strict=True)]
    timed = {"keyframes": frames, "repeat": path.mode, "ease": path.ease, "phase": path.phase, "start": path.start}
    try:
        return Travel.model_validate(timed)
    except ValidationError as error:
        changes.append(f"{name}: its motion cannot be written as keyframes: {first_reason(error)}; it is made static")
        return None


def _waypoints(path: MotionPath) -> list[list[float]]:
    """Return the corners [x, y] of a path without its first point and, for a loop, without its last point.

    Returns [] if waypoints cannot describe the path, because its `ease` is not "linear" or its duration is 0.
    """
    points = [(round(pose.x, DECIMALS), round(pose.y, DECIMALS)) for pose in path.poses]
    turns = [b for a, b, c in zip(points, points[1:], points[2:], strict=False) if not _is_straight(a, b, c)]
    corners = [*turns, *(points[-1:] if path.mode != "loop" else [])]
    return [list(corner) for corner in corners] if path.ease == "linear" and path.times[-1] > 0 else []


def _is_straight(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    """Return whether a path from `a` to `c` does not turn at `b`."""
    (ux, uy), (vx, vy) = (b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1])
    max_cross_product = STRAIGHT_TOLERANCE_RAD * math.hypot(ux, uy) * math.hypot(vx, vy)
    return ux * vx + uy * vy >= 0 and abs(ux * vy - uy * vx) <= max_cross_product


def _are_same_motion(converted: MotionPath, path: MotionPath, is_round: bool) -> bool:
    """Return whether two paths have equal durations and poses. Headings of round objects are ignored."""
    times = sorted({*converted.times, *path.times})
    pairs = [(pose_at(converted, t + path.start), pose_at(path, t + path.start)) for t in times]
    return math.isclose(converted.times[-1], path.times[-1], rel_tol=1e-6) and all(
        a.distance(b) < 10**-DECIMALS and (is_round or abs(wrap(a.yaw - b.yaw)) < 10**-DECIMALS) for a, b in pairs
    )
