"""Convert solids to upright shapes, the only shapes of world files.

A solid without an equal upright shape is replaced by upright prisms whose base is its cross section.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydantic import ValidationError

from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Box, Cylinder, Extrusion, Solid, TriangleMesh
from simscen.model.world import Obstacle
from simscen.spec.places import PoseSpec
from simscen.worlds.geometry.cross_section import cross_section
from simscen.worlds.geometry.section_polygons import (
    MAX_CORNERS,
    OpenCrossSection,
    rings_from_segments,
    signed_area,
    simple_polygons,
)
from simscen.worlds.geometry.triangulation import enclosed_volume, merge_solids

MIN_UPRIGHT_COSINE = 1 - 1e-8
"""Minimum cosine of the tilt of an upright solid, which leans by at most 0.14 mm per meter."""
DECIMALS = 6
"""Number of decimals of lengths (m) and angles (rad) in the world file."""


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
    above_ground = [
        shape if shape.bottom >= 0 else replace(shape, bottom=0.0, height=shape.height + shape.bottom)
        for shape in shapes
        if shape.bottom + shape.height > 10**-DECIMALS
    ]
    if shapes and not above_ground:
        changes.append(f"{solid.name}: it is below the ground; it is left out")
    return [shape for shape in above_ground if _is_valid(shape, solid.name, changes)]


def _is_valid(shape: PrismShape, name: str, changes: list[str]) -> bool:
    """Return whether a shape is valid in a world file. If not, e.g. if it is too thin, add the reason to `changes`."""
    try:
        Obstacle.model_validate({"name": "shape", **shape.fields})
    except ValidationError as error:
        changes.append(f"{name}: {first_problem(error)}; it is left out")
        return False
    return True


def first_problem(error: ValidationError) -> str:
    """Return the first problem of a validation, e.g. "its `box` is not valid: input should be greater than 0"."""
    return f"its `{error.errors()[0]['loc'][0]}` is not valid: {first_reason(error)}"


def first_reason(error: ValidationError) -> str:
    """Return the reason for the first problem of a validation, e.g. "input should be greater than 0"."""
    message = error.errors()[0]["msg"].removeprefix("Value error, ")
    return f"{message[:1].lower()}{message[1:]}"


def _exact_shape(solid: Solid) -> PrismShape | None:
    """Return the shape that equals a solid; None if the solid is not upright or world files have no such shape."""
    rotation, pose = solid.pose.rotation(), solid.pose
    up = int(np.argmax(np.abs(rotation[2])))  # index of the axis of the shape that is vertical
    if abs(rotation[2, up]) < MIN_UPRIGHT_COSINE:
        return None
    along, across = ((1, 2), (0, 2), (0, 1))[up]
    planar_pose = Pose2(pose.x, pose.y, math.atan2(rotation[1, along], rotation[0, along]))
    match solid.shape:
        case Box(size):
            return PrismShape(planar_pose, pose.z - size[up] / 2, size[up], box=(size[along], size[across]))
        case Cylinder(radius, length) if up == 2:
            return PrismShape(Pose2(pose.x, pose.y), pose.z - length / 2, length, radius=radius)
        case Extrusion(polygon, extrusion_height) if up == 2 and rotation[2, 2] > 0 and len(polygon) <= MAX_CORNERS:
            return PrismShape(planar_pose, pose.z, extrusion_height, polygon=polygon)
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
    if not _equals_prisms(mesh, sum(map(signed_area, pieces)) * (high - low)):
        prisms = "an upright prism" if len(pieces) == 1 else f"{len(pieces)} upright prisms"
        changes.append(f"{solid.name}: {kind}; replaced by {prisms} over its cross section at {section_height:.3g} m")
    for piece in pieces:
        x, y = _rounded(np.mean(piece, axis=0).tolist())
        yield PrismShape(Pose2(x, y), low, high - low, polygon=tuple((px - x, py - y) for px, py in piece))


def _equals_prisms(mesh: TriangleMesh, volume: float) -> bool:
    """Return whether prisms of this volume (m³) equal a mesh: same volume, and no face of the mesh is tilted."""
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    normals = np.cross(b - a, c - a)
    horizontal, vertical = np.linalg.norm(normals[:, :2], axis=1), np.abs(normals[:, 2])
    is_tilted = np.minimum(horizontal, vertical) > 1e-6 * np.linalg.norm(normals, axis=1) + 1e-12
    return not is_tilted.any() and math.isclose(enclosed_volume(mesh), volume, rel_tol=1e-6)


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(value, DECIMALS) + 0.0 for value in values]  # + 0.0 makes -0.0 positive
