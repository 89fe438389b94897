"""Build the world that a world file specifies: walls with mitered corners, obstacles, ramps, objects, and doors."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.motion_paths import pose_at
from simscen.core.geometry.shapes import Body, Box, Extrusion, Mesh, Solid
from simscen.model.world import Door, Movable, WorldSpec
from simscen.worlds.extent import union
from simscen.worlds.geometry.prisms import bounding_rectangle

Point = tuple[float, float]
"""(x, y) in m."""

MIN_MITER_COSINE = -0.5
"""Cosine of the sharpest turn (120°) with a miter.

At sharper turns, the tip of a miter would be farther from the corner of the center line than the wall is thick.
"""
_WEDGE_FACES = (0, 1, 3), (0, 3, 2), (0, 4, 5), (0, 5, 1), (2, 3, 5), (2, 5, 4), (0, 2, 4), (1, 5, 3)
"""Corners of each face of a ramp (see `ramp_solid`), counterclockwise as seen from outside.

Two triangles each for the bottom, the slope, and the upper end, and one each for the right and the left side."""


def world_from_spec(
    spec: WorldSpec,
    name: str,
    grid: OccupancyGrid | None = None,
    base: World | None = None,
    notes: tuple[str, ...] = (),
) -> World:
    """Return the world that `spec` specifies.

    name:   name of the world if `spec` has none
    grid:   occupancy grid of the key `map`; becomes walls of the height `map_height`, and the robot's map
    base:   world of the key `sdf`; its solids and bodies come first, and `spec` overrides its places and regions
    notes:  notes of the map's loader, appended to the notes of `base`
    """
    base = base or World(name, ())
    solids = _solids_from_spec(spec, grid)
    bodies = (*map(_object_body, spec.objects), *map(_door_body, spec.doors))
    places = {**base.places, **{key: place.pose for key, place in spec.places.items()}}
    regions = {key: tuple((x, y) for x, y in corners) for key, corners in spec.regions.items()}
    rectangles = [(place.x, place.y, place.x, place.y) for place in places.values()]
    rectangles += [bounding_rectangle(solid) for solid in solids]
    rectangles += [bounding_rectangle(solid, body.pose) for body in bodies for solid in body.solids]
    rectangles += [base.bounds] if any(base.bounds) else []
    rectangles += [(x, y, x, y) for x, y in grid.corners] if grid is not None else []
    return replace(
        base,
        name=spec.name or name,
        solids=(*base.solids, *solids),
        bodies=(*base.bodies, *bodies),
        places=places,
        regions={**base.regions, **regions},
        friction=spec.friction,
        doors={door.name: _panel_poses(door) for door in spec.doors},
        bounds=union(rectangles),
        grid=grid or base.grid,
        notes=(*base.notes, *notes),
    )


def _solids_from_spec(spec: WorldSpec, grid: OccupancyGrid | None) -> list[Solid]:
    """Return the static solids that `spec` specifies, including the walls of its map `grid`, but no imported solids."""
    solids: list[Solid] = []
    if grid is not None:
        from simscen.worlds.maps.occupancy_map import walls_from_map

        solids += walls_from_map(grid, spec.map_height)
    for number, wall in enumerate(spec.walls, start=1):
        points = [(x, y) for x, y in wall.points]
        solids += wall_solids(points, wall.thickness, wall.height, wall.label(number))
    for obstacle in spec.obstacles:
        solid = obstacle.solid(obstacle.name)
        pose = Pose3.planar(obstacle.pose.pose, solid.pose.z)
        solids.append(replace(solid, pose=pose, friction=obstacle.friction))
    for ramp in spec.ramps:
        (start_x, start_y), (end_x, end_y) = ramp.start, ramp.end
        solids.append(ramp_solid((start_x, start_y), (end_x, end_y), ramp.width, ramp.height, ramp.name, ramp.friction))
    return solids


def _panel_poses(door: Door) -> tuple[Pose2, Pose2]:
    """Return the poses of a door's panel when closed and when open.

    A swinging panel turns counterclockwise by 90° about the hinge, the first of `door.points`. A sliding panel moves
    past this point.
    """
    (hx, hy), (px, py) = door.points
    closed = Pose2(hx, hy, math.atan2(py - hy, px - hx))
    if door.motion == "swing":
        return closed, closed.compose(Pose2(0.0, 0.0, math.pi / 2))
    return closed, closed.compose(Pose2(-(door.travel or math.hypot(px - hx, py - hy)), 0.0))


def _object_body(movable: Movable) -> Body:
    """Return the body of an object. With keyframes, the body starts at the first keyframe."""
    pose, path = movable.pose.pose, None
    if movable.move is not None:
        path = movable.move.path(pose, movable.move.start)
        pose = pose if movable.move.keyframes is None else pose_at(path, 0.0)
    return Body(movable.name, (movable.solid(movable.name),), Pose3.planar(pose), movable.mass, path)


def _door_body(door: Door) -> Body:
    """Return the panel of a door as a body, with its origin at the hinge."""
    (hinge_x, hinge_y), (post_x, post_y) = door.points
    closed, opened = _panel_poses(door)
    width = math.hypot(post_x - hinge_x, post_y - hinge_y)
    panel = Solid(Box((width, door.thickness, door.height)), Pose3(x=width / 2, z=door.height / 2), door.name)
    return Body(door.name, (panel,), Pose3.planar(closed if door.closed else opened))


def wall_solids(points: list[Point], thickness: float, height: float, name: str) -> list[Solid]:
    """Return one prism for each straight part of a wall with the center line `points`; thickness and height in m.

    The wall is closed if the last point equals the first. Turns up to 120° are mitered. At sharper turns, and for parts
    that are too short for a miter, the prisms are extended by half the thickness and overlap. Repeated points are
    skipped.
    """
    corners = [p for k, p in enumerate(points) if k == 0 or p != points[k - 1]]
    if len(corners) < 2:
        return []
    directions = [_direction(a, b) for a, b in pairwise(corners)]
    is_closed = len(directions) > 1 and corners[0] == corners[-1]
    before = [directions[-1] if is_closed else None, *directions[:-1]]
    after = [*directions[1:], directions[0] if is_closed else None]
    solids = []
    for (a, b), direction, previous, following in zip(pairwise(corners), directions, before, after, strict=True):
        start = _miter_end(a, direction, previous, thickness / 2, -1.0)
        end = _miter_end(b, direction, following, thickness / 2, 1.0)
        (ux, uy), sides = direction, zip(start, end, strict=True)
        if any((bx - ax) * ux + (by - ay) * uy <= 0 for (ax, ay), (bx, by) in sides):  # the miters cross
            start, end = _square_end(a, direction, thickness / 2, -1.0), _square_end(b, direction, thickness / 2, 1.0)
        solids.append(Solid(Extrusion((start[1], end[1], end[0], start[0]), height), name=name))
    return solids


def _direction(a: Point, b: Point) -> Point:
    """Return the unit vector from `a` to `b`."""
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def _miter_end(corner: Point, direction: Point, other: Point | None, half: float, side: float) -> tuple[Point, Point]:
    """Return the left and right corner at one end of a part of a wall, mitered if possible.

    corner:     end of the center line of the part
    direction:  unit vector along the part
    other:      unit vector along the part that is joined at this end; None without one
    half:       half of the thickness in m
    side:       -1 at the start of the part, 1 at its end
    """
    (x, y), (ux, uy) = corner, direction
    if other is None:
        return (x - uy * half, y + ux * half), (x + uy * half, y - ux * half)
    cosine = ux * other[0] + uy * other[1]
    if cosine < MIN_MITER_COSINE:
        return _square_end(corner, direction, half, side)
    left = (-uy - other[1]) * half / (1 + cosine), (ux + other[0]) * half / (1 + cosine)
    return (x + left[0], y + left[1]), (x - left[0], y - left[1])


def _square_end(corner: Point, direction: Point, half: float, side: float) -> tuple[Point, Point]:
    """Return the left and right corner of an end that is extended by `half`; parameters as in `_miter_end`."""
    (x, y), (ux, uy) = corner, direction
    x, y = x + ux * half * side, y + uy * half * side
    return (x - uy * half, y + ux * half), (x + uy * half, y - ux * half)


def ramp_solid(start: Point, end: Point, width: float, height: float, name: str, friction: float = 1.0) -> Solid:
    """Return a ramp, `width` m wide, whose center line rises from the ground at `start` to `height` m at `end`."""
    # In pairs (right, left): the foot, the points below the upper edge, and the upper edge.
    length, half = math.dist(start, end), width / 2
    corners = np.array(
        [[0, -half, 0], [0, half, 0], [length, -half, 0], [length, half, 0], [length, -half, height],
         [length, half, height]]
    )  # fmt: skip
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    wedge = Mesh(corners, np.array(_WEDGE_FACES, dtype=np.int32))
    return Solid(wedge, Pose3.planar(Pose2(*start, yaw)), name, friction)
