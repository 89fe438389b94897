"""Conversion of imported worlds to world files: exact shapes where possible, else prisms over a cross section."""

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
from simscen.worlds.geometry.cross_section import (
    MAX_CORNERS,
    OpenCrossSection,
    rings_from_segments,
    section_segments,
    signed_area,
    simple_polygons,
)
from simscen.worlds.geometry.triangulation import merge_solids

MIN_UPRIGHT_COSINE = 1 - 1e-8
"""Cosine of the tilt up to which a solid is upright: 0.1 mm per meter."""
DIGITS = 6
"""Decimals of lengths in m that are written."""
MAX_NAME_LENGTH = 120
STRAIGHT_TOLERANCE_RAD = 1e-6
"""Change of direction up to which a path is straight."""


@dataclass(frozen=True)
class PrismShape:
    """Shape of a world file that begins `bottom` m above the ground and is `height` m tall.

    Exactly one of these is given: `box` (lengths along x and y), `radius`, or `polygon` (corners in the frame of
    `pose`).
    """

    pose: Pose2
    bottom: float
    height: float
    box: tuple[float, float] | None = None
    radius: float | None = None
    polygon: tuple[tuple[float, float], ...] = ()

    @property
    def fields(self) -> dict[str, object]:
        """The fields of an obstacle except its name, rounded to the micrometer."""
        x, y, yaw = _rounded(self.pose)
        height, bottom = round(self.height, DIGITS), round(self.bottom, DIGITS)
        fields: dict[str, object] = {"pose": PoseSpec(x=x, y=y, yaw=yaw)}
        if self.box is not None:
            fields["box"] = [*_rounded(self.box), height]
        elif self.radius is not None:
            fields["cylinder"] = [round(self.radius, DIGITS), height]
        else:
            fields |= {"polygon": [_rounded(point) for point in self.polygon], "height": height}
        return {**fields, "z": bottom} if bottom > 0 else fields


def prism_shapes(solid: Solid, height: float, changes: list[str]) -> list[PrismShape]:
    """Return the shapes of a solid above the ground; add a sentence to `changes` for each difference.

    A solid without exact equivalent is replaced by its cross section at `height` m, or at half its height if it does
    not reach that height.
    """
    exact = _exact_shape(solid)
    shapes = [exact] if exact else list(_prisms(solid, height, changes))
    above = [_above_ground(shape) for shape in shapes if shape.bottom + shape.height > 10**-DIGITS]
    if shapes and not above:
        changes.append(f"{solid.name}: it is below the ground; it is left out")
    return [shape for shape in above if _is_valid(shape, solid.name, changes)]


def _is_valid(shape: PrismShape, name: str, changes: list[str]) -> bool:
    """Return whether a shape is valid in a world file. If not, e.g. if it is too thin, add the reason to `changes`."""
    try:
        Obstacle.model_validate({"name": "shape", **shape.fields})
    except ValidationError as error:
        changes.append(f"{name}: {_reason(error)}; it is left out")
        return False
    return True


def _reason(error: ValidationError) -> str:
    """Return the first problem, e.g. "its `box` is not valid: input should be greater than 0"."""
    problem = error.errors()[0]
    message = problem["msg"].removeprefix("Value error, ")
    return f"its `{problem['loc'][0]}` is not valid: {message[:1].lower()}{message[1:]}"


def _exact_shape(solid: Solid) -> PrismShape | None:
    """Return the shape that equals a solid; None if it is not upright or world files have no such shape."""
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


def _prisms(solid: Solid, height: float, changes: list[str]) -> Iterator[PrismShape]:
    """Yield prisms over the cross section of a solid."""
    mesh = merge_solids([solid])
    kind = type(solid.shape).__name__.lower()
    kind = f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"
    low, high = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
    section_height = height if low < height <= high else (low + high) / 2
    try:
        pieces = simple_polygons(rings_from_segments(section_segments(mesh, section_height)))
    except OpenCrossSection:
        changes.append(
            f"{solid.name}: {kind} whose cross section at {section_height:g} m is not closed; it is left out"
        )
        return
    if not pieces:
        changes.append(f"{solid.name}: {kind} that is flat; it is left out")
        return
    if not _is_prism(solid, sum(map(signed_area, pieces)) * (high - low)):
        prisms = "an upright prism" if len(pieces) == 1 else f"{len(pieces)} upright prisms"
        changes.append(f"{solid.name}: {kind}; replaced by {prisms} over its cross section at {section_height:.3g} m")
    for piece in pieces:
        x, y = _rounded(np.mean(piece, axis=0).tolist())
        yield PrismShape(Pose2(x, y), low, high - low, polygon=tuple((px - x, py - y) for px, py in piece))


def _is_prism(solid: Solid, volume: float) -> bool:
    """Return whether a solid equals its prisms: all faces are level or upright, and the volume is the same."""
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
    return [round(value, DIGITS) + 0.0 for value in values]  # + 0.0 makes -0.0 positive


@dataclass
class Conversion:
    """Obstacles and objects of a world file, and a sentence for each difference from the imported world."""

    obstacles: list[Obstacle] = field(default_factory=list)
    objects: list[Movable] = field(default_factory=list)
    changes: list[str] = field(default_factory=list)

    def merged_into(self, spec: WorldSpec) -> WorldSpec:
        """Return a specification in which these come before the obstacles and objects of `spec`.

        Raises pydantic.ValidationError if there are too many.
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
    """Convert the solids and bodies of a world.

    Solids without exact equivalent are replaced by their cross section at `height` m, or left out, with a sentence.
    """
    conversion = Conversion()
    for solid in world.solids:
        friction = {"friction": solid.friction} if solid.friction != 1.0 else {}
        for shape in prism_shapes(solid, height, conversion.changes):
            _add_obstacle({"name": _name(solid.name), **shape.fields, **friction}, conversion)
    for body in world.bodies:
        _add_body(body, height, conversion)
    return conversion


def _add_obstacle(fields: dict[str, object], conversion: Conversion) -> None:
    try:
        conversion.obstacles.append(Obstacle.model_validate(fields))
    except ValidationError as error:
        conversion.changes.append(f"{fields['name']}: {_reason(error)}; it is left out")


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
            _add_obstacle({"name": _name(body.name), **shape.fields}, conversion)
        return
    travel = _travel(body, shapes[0], conversion.changes) if body.path else None
    fields = {"name": _name(body.name), "mass": body.mass, "move": travel, **shapes[0].fields}
    try:
        conversion.objects.append(Movable.model_validate(fields))
    except ValidationError as error:
        conversion.changes.append(f"{body.name}: {_reason(error)}; it is left out")


def _travel(body: Body, shape: PrismShape, changes: list[str]) -> Travel | None:
    """Return the scripted motion: waypoints if it is straight with a constant speed, else keyframes."""
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
    if start.distance(first) > 10**-DIGITS or not (is_round or abs(wrap(start.yaw - first.yaw)) < 10**-DIGITS):
        changes.append(f"{body.name}: it moves, but its shape is not at its origin; it is made static")
        return None
    frames = [[time, *np.round(pose, DIGITS).tolist()] for time, pose in zip(path.times, path.poses, strict=True)]
    timed = {"keyframes": frames, "repeat": path.mode, "ease": path.ease, "phase": path.phase, "start": path.start}
    try:
        return Travel.model_validate(timed)
    except ValidationError as error:
        changes.append(
            f"{body.name}: its motion cannot be written as keyframes ({error.errors()[0]['msg']}); it is made static"
        )
        return None


def _waypoints(path: MotionPath) -> list[list[float]]:
    """Return the corners of a path after its start, without the return of a loop; empty if it is eased."""
    points = [(round(pose.x, DIGITS), round(pose.y, DIGITS)) for pose in path.poses]
    turns = [b for a, b, c in zip(points, points[1:], points[2:], strict=False) if not _in_line(a, b, c)]
    corners = [*turns, *(points[-1:] if path.mode != "loop" else [])]
    return [list(corner) for corner in corners] if path.ease == "linear" and path.times[-1] > 0 else []


def _in_line(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    (ux, uy), (vx, vy) = (b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1])
    return ux * vx + uy * vy >= 0 and abs(ux * vy - uy * vx) <= STRAIGHT_TOLERANCE_RAD * math.hypot(
        ux, uy
    ) * math.hypot(vx, vy)


def _are_same_motion(converted: MotionPath, path: MotionPath, is_round: bool) -> bool:
    """Return whether two paths have the same poses at all their times; headings of round objects are ignored."""
    times = sorted({*converted.times, *path.times})
    pairs = [(pose_at(converted, t + path.start), pose_at(path, t + path.start)) for t in times]
    return math.isclose(converted.times[-1], path.times[-1], rel_tol=1e-6) and all(
        a.distance(b) < 10**-DIGITS and (is_round or abs(wrap(a.yaw - b.yaw)) < 10**-DIGITS) for a, b in pairs
    )


def _name(name: str) -> str:
    return name[:MAX_NAME_LENGTH] or "obstacle"
