"""Convert imported worlds (SDF) to the obstacles and objects of a world file.

World files have only upright shapes. Any other solid is replaced by upright prisms whose base is its cross section.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from pydantic import ValidationError

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.motion_paths import pose_at
from simscen.core.geometry.shapes import Body, Box, Cylinder, Extrusion, MotionPath, Solid
from simscen.model.world import Movable, Obstacle, Travel, WorldSpec
from simscen.spec.places import PoseSpec
from simscen.worlds.geometry.cross_section import cross_section
from simscen.worlds.geometry.section_polygons import (
    MAX_CORNERS,
    OpenCrossSection,
    rings_from_segments,
    signed_area,
    simple_polygons,
)
from simscen.worlds.geometry.triangulation import merge_solids

MIN_UPRIGHT_COSINE = 1 - 1e-8
"""Minimum cosine of the tilt of an upright solid, which leans by at most 0.14 mm per meter."""
DECIMALS = 6
"""Number of decimals of lengths (m) and angles (rad) in the world file."""
MAX_NAME_LENGTH = 120
"""Maximum number of characters of a name in a world file. Longer names are cut."""
STRAIGHT_TOLERANCE_RAD = 1e-6
"""Maximum change of direction at a point where a path does not turn."""


@dataclass(frozen=True)
class PrismShape:
    """Upright shape of a world file. It begins `bottom` m above the ground and is `height` m tall.

    Its base, in the frame of `pose`, is a `box` (side lengths in m along x and y), a circle of `radius` m, or a
    `polygon` (corners in m).
    """

    pose: Pose2
    bottom: float
    height: float
    box: tuple[float, float] | None = None
    radius: float | None = None
    polygon: tuple[tuple[float, float], ...] = ()

    @property
    def fields(self) -> dict[str, object]:
        """The keys of an obstacle in a world file except `name`, with their values; lengths rounded to 1 µm."""
        x, y, yaw = _rounded(self.pose)
        height, bottom = round(self.height, DECIMALS), round(self.bottom, DECIMALS)
        fields: dict[str, object] = {"pose": PoseSpec(x=x, y=y, yaw=yaw)}
        if self.box is not None:
            fields["box"] = [*_rounded(self.box), height]
        elif self.radius is not None:
            fields["cylinder"] = [round(self.radius, DECIMALS), height]
        else:
            fields |= {"polygon": [_rounded(point) for point in self.polygon], "height": height}
        return {**fields, "z": bottom} if bottom > 0 else fields


def prism_shapes(solid: Solid, height: float, changes: list[str]) -> list[PrismShape]:
    """Return the shapes of a world file that represent a solid, without any part below the ground.

    If no such shape equals the solid, the shapes are prisms over its cross section at `height` m. If the solid is
    entirely above or below `height`, the cross section is at its middle. A sentence about each difference is appended
    to `changes`.
    """
    exact = _exact_shape(solid)
    shapes = [exact] if exact else list(_cross_section_prisms(solid, height, changes))
    above = [_above_ground(shape) for shape in shapes if shape.bottom + shape.height > 10**-DECIMALS]
    if shapes and not above:
        changes.append(f"{solid.name}: it is below the ground; it is left out")
    return [shape for shape in above if _is_valid(shape, solid.name, changes)]


def _is_valid(shape: PrismShape, name: str, changes: list[str]) -> bool:
    """Return whether a shape is valid in a world file. If not, e.g. if it is too thin, add the reason to `changes`."""
    try:
        Obstacle.model_validate({"name": "shape", **shape.fields})
    except ValidationError as error:
        changes.append(f"{name}: {_first_problem(error)}; it is left out")
        return False
    return True


def _first_problem(error: ValidationError) -> str:
    """Return the first problem of a validation, e.g. "its `box` is not valid: input should be greater than 0"."""
    problem = error.errors()[0]
    message = problem["msg"].removeprefix("Value error, ")
    return f"its `{problem['loc'][0]}` is not valid: {message[:1].lower()}{message[1:]}"


def _exact_shape(solid: Solid) -> PrismShape | None:
    """Return the shape that equals a solid; None if the solid is not upright or world files have no such shape."""
    rotation, pose = solid.pose.rotation(), solid.pose
    up = int(np.argmax(np.abs(rotation[2])))
    if abs(rotation[2, up]) < MIN_UPRIGHT_COSINE:
        return None
    along, across = ((1, 2), (0, 2), (0, 1))[up]
    place = Pose2(pose.x, pose.y, math.atan2(rotation[1, along], rotation[0, along]))
    match solid.shape:
        case Box(size):
            return PrismShape(place, pose.z - size[up] / 2, size[up], box=(size[along], size[across]))
        case Cylinder(radius, length) if up == 2:
            return PrismShape(Pose2(pose.x, pose.y), pose.z - length / 2, length, radius=radius)
        case Extrusion(polygon, extrusion_height) if up == 2 and rotation[2, 2] > 0 and len(polygon) <= MAX_CORNERS:
            return PrismShape(place, pose.z, extrusion_height, polygon=polygon)
        case _:
            return None


def _cross_section_prisms(solid: Solid, height: float, changes: list[str]) -> Iterator[PrismShape]:
    """Yield prisms over the cross section of a solid (see `prism_shapes`); none if it is empty or not closed."""
    mesh = merge_solids([solid])
    kind = type(solid.shape).__name__.lower()
    kind = f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"
    low, high = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
    section_height = height if low < height <= high else (low + high) / 2
    try:
        pieces = simple_polygons(rings_from_segments(cross_section(mesh, section_height).segments))
    except OpenCrossSection:
        changes.append(
            f"{solid.name}: {kind} whose cross section at {section_height:g} m is not closed; it is left out"
        )
        return
    if not pieces:
        changes.append(f"{solid.name}: {kind} that is flat; it is left out")
        return
    if not _equals_prisms(solid, sum(map(signed_area, pieces)) * (high - low)):
        prisms = "an upright prism" if len(pieces) == 1 else f"{len(pieces)} upright prisms"
        changes.append(f"{solid.name}: {kind}; replaced by {prisms} over its cross section at {section_height:.3g} m")
    for piece in pieces:
        x, y = _rounded(np.mean(piece, axis=0).tolist())
        yield PrismShape(Pose2(x, y), low, high - low, polygon=tuple((px - x, py - y) for px, py in piece))


def _equals_prisms(solid: Solid, volume: float) -> bool:
    """Return whether prisms of this volume (m³) equal a solid: same volume, and all its faces are level or upright."""
    mesh = merge_solids([solid])
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    normals = np.cross(b - a, c - a)
    level, upright = np.linalg.norm(normals[:, :2], axis=1), np.abs(normals[:, 2])
    tilted = np.minimum(level, upright) > 1e-6 * np.linalg.norm(normals, axis=1) + 1e-12
    solid_volume = float(np.sum(a * np.cross(b, c)) / 6)
    return not tilted.any() and math.isclose(solid_volume, volume, rel_tol=1e-6)


def _above_ground(shape: PrismShape) -> PrismShape:
    """Return a shape without its part below the ground."""
    return shape if shape.bottom >= 0 else replace(shape, bottom=0.0, height=shape.height + shape.bottom)


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(value, DECIMALS) + 0.0 for value in values]  # + 0.0 makes -0.0 positive


@dataclass
class Conversion:
    """Obstacles and objects for a world file. `changes` has a sentence for each difference from the imported world."""

    obstacles: list[Obstacle] = field(default_factory=list)
    objects: list[Movable] = field(default_factory=list)
    changes: list[str] = field(default_factory=list)

    def merged_into(self, spec: WorldSpec) -> WorldSpec:
        """Return a copy of `spec` with these obstacles and objects in front of its own, and without `sdf`.

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
            _add_obstacle({"name": _valid_name(solid.name), **shape.fields, **friction}, conversion)
    for body in world.bodies:
        _add_body(body, height, conversion)
    return conversion


def _add_obstacle(fields: dict[str, object], conversion: Conversion) -> None:
    """Add an obstacle with these `fields`, or a sentence in `changes` if they are not valid."""
    try:
        conversion.obstacles.append(Obstacle.model_validate(fields))
    except ValidationError as error:
        conversion.changes.append(f"{fields['name']}: {_first_problem(error)}; it is left out")


def _add_body(body: Body, height: float, conversion: Conversion) -> None:
    """Add the body as an object, or as obstacles if it has several shapes, because an object can have only one."""
    placed = [Solid(solid.shape, body.pose.compose(solid.pose), body.name) for solid in body.solids]
    shapes = [shape for solid in placed for shape in prism_shapes(solid, height, conversion.changes)]
    if not shapes:
        return
    if len(shapes) > 1:
        moves = "moved" if body.path else "could be pushed" if body.mass else "could be moved"
        conversion.changes.append(
            f"{body.name}: it {moves} and has {len(shapes)} shapes, but an object can have only one; it is made static"
        )
        for shape in shapes:
            _add_obstacle({"name": _valid_name(body.name), **shape.fields}, conversion)
        return
    travel = _travel(body, shapes[0], conversion.changes) if body.path else None
    fields = {"name": _valid_name(body.name), "mass": body.mass, "move": travel, **shapes[0].fields}
    try:
        conversion.objects.append(Movable.model_validate(fields))
    except ValidationError as error:
        conversion.changes.append(f"{body.name}: {_first_problem(error)}; it is left out")


def _travel(body: Body, shape: PrismShape, changes: list[str]) -> Travel | None:
    """Return the scripted motion of a body; None with a sentence in `changes` if the motion cannot be converted.

    The motion has waypoints if the body moves along straight lines with a constant speed, otherwise keyframes. `shape`
    is the shape of the body at its initial pose.
    """
    assert body.path is not None
    path, start, is_round = body.path, shape.pose, shape.radius is not None
    if waypoints := _waypoints(path):
        speed = sum(a.distance(b) for a, b in pairwise(path.poses)) / path.times[-1]
        by_waypoints = {"through": waypoints, "speed": speed, "repeat": path.mode, "start": path.start}
        with suppress(ValidationError):  # keyframes may still describe the motion
            travel = Travel.model_validate(by_waypoints)
            if _are_same_motion(travel.path(start, path.start), path, is_round):
                return travel
    first = pose_at(path, 0.0)
    if start.distance(first) > 10**-DECIMALS or not (is_round or abs(wrap(start.yaw - first.yaw)) < 10**-DECIMALS):
        changes.append(f"{body.name}: it moves, but its shape is not at its origin; it is made static")
        return None
    frames = [[time, *np.round(pose, DECIMALS).tolist()] for time, pose in zip(path.times, path.poses, strict=True)]
    timed = {"keyframes": frames, "repeat": path.mode, "ease": path.ease, "phase": path.phase, "start": path.start}
    try:
        return Travel.model_validate(timed)
    except ValidationError as error:
        changes.append(
            f"{body.name}: its motion cannot be written as keyframes ({error.errors()[0]['msg']}); it is made static"
        )
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
    return ux * vx + uy * vy >= 0 and abs(ux * vy - uy * vx) <= STRAIGHT_TOLERANCE_RAD * math.hypot(
        ux, uy
    ) * math.hypot(vx, vy)


def _are_same_motion(converted: MotionPath, path: MotionPath, is_round: bool) -> bool:
    """Return whether two paths have equal durations and poses. Headings of round objects are ignored."""
    times = sorted({*converted.times, *path.times})
    pairs = [(pose_at(converted, t + path.start), pose_at(path, t + path.start)) for t in times]
    return math.isclose(converted.times[-1], path.times[-1], rel_tol=1e-6) and all(
        a.distance(b) < 10**-DECIMALS and (is_round or abs(wrap(a.yaw - b.yaw)) < 10**-DECIMALS) for a, b in pairs
    )


def _valid_name(name: str) -> str:
    return name[:MAX_NAME_LENGTH] or "obstacle"
