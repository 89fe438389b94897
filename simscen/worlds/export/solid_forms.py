"""A solid in the words of our own language: as it is where they suffice, else as prisms over its cut."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Box, Cylinder, Extrusion, Solid
from simscen.spec.places import PoseSpec
from simscen.worlds.export.cut_polygons import MOST_CORNERS, OpenCut, area, pieces_of, rings_of
from simscen.worlds.geometry.cross_section import outlines
from simscen.worlds.geometry.triangulation import fuse

UPRIGHT = 1 - 1e-8
"""Cosine of the tilt up to which something counts as upright: 0.1 mm on a meter."""
DIGITS = 6
"""Decimals of a meter that are written."""


@dataclass(frozen=True)
class Form:
    """One shape of our language, from `bottom` meters above the ground to `height` meters above that.

    Exactly one is given: `box` (lengths along x and y), `radius`, or `polygon` (corners in the frame of `pose`).
    """

    pose: Pose2
    bottom: float
    height: float
    box: tuple[float, float] | None = None
    radius: float | None = None
    polygon: tuple[tuple[float, float], ...] = ()

    @property
    def fields(self) -> dict[str, object]:
        """The fields of an obstacle but for its name, rounded to the micrometer."""
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


def forms_of(solid: Solid, height: float, changes: list[str]) -> list[Form]:
    """The forms of a solid; a sentence goes to `changes` when they are not exactly what it was above the ground.

    What cannot be said exactly is cut at `height` meters, or at half its height where that misses it.
    """
    exact = _exact(solid)
    found = [exact] if exact else list(_prisms(solid, height, changes))
    standing = [_cut_off(form) for form in found if form.bottom + form.height > 10**-DIGITS]
    if found and not standing:
        changes.append(f"{solid.name}: it lies below the ground; it is left out")
    return standing


def _exact(solid: Solid) -> Form | None:
    """The same solid in our language, if it is upright."""
    turn, pose = solid.pose.rotation(), solid.pose
    up = int(np.argmax(np.abs(turn[2])))
    if abs(turn[2, up]) < UPRIGHT:
        return None
    along, across = ((1, 2), (0, 2), (0, 1))[up]
    place = Pose2(pose.x, pose.y, math.atan2(turn[1, along], turn[0, along]))
    match solid.shape:
        case Box(size):
            return Form(place, pose.z - size[up] / 2, size[up], box=(size[along], size[across]))
        case Cylinder(radius, length) if up == 2:
            return Form(Pose2(pose.x, pose.y), pose.z - length / 2, length, radius=radius)
        case Extrusion(polygon, tall) if up == 2 and turn[2, 2] > 0 and len(polygon) <= MOST_CORNERS:
            return Form(place, pose.z, tall, polygon=polygon)
        case _:
            return None


def _prisms(solid: Solid, height: float, changes: list[str]) -> Iterator[Form]:
    mesh = fuse([solid])
    kind = type(solid.shape).__name__.lower()
    kind = f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"
    low, high = float(mesh.vertices[:, 2].min()), float(mesh.vertices[:, 2].max())
    at = height if low < height <= high else (low + high) / 2
    try:
        pieces = pieces_of(rings_of(outlines(mesh, at)))
    except OpenCut:
        changes.append(f"{solid.name}: {kind} whose cut at {at:g} m is not closed; it is left out")
        return
    if not pieces:
        changes.append(f"{solid.name}: {kind} that is flat; it is left out")
        return
    if not _is_prism(solid, sum(map(area, pieces)) * (high - low)):
        prisms = "an upright prism" if len(pieces) == 1 else f"{len(pieces)} upright prisms"
        changes.append(f"{solid.name}: {kind}; it became {prisms} over its cut at {at:.3g} m")
    for piece in pieces:
        x, y = _rounded(np.mean(piece, axis=0).tolist())
        yield Form(Pose2(x, y), low, high - low, polygon=tuple((px - x, py - y) for px, py in piece))


def _is_prism(solid: Solid, volume: float) -> bool:
    """Whether every face is level or upright, and the volume that of the prisms: then nothing has changed."""
    mesh = fuse([solid])
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    normals = np.cross(b - a, c - a)
    level, upright = np.linalg.norm(normals[:, :2], axis=1), np.abs(normals[:, 2])
    tilted = np.minimum(level, upright) > 1e-6 * np.linalg.norm(normals, axis=1) + 1e-12
    own = float(np.sum(a * np.cross(b, c)) / 6)
    return not tilted.any() and math.isclose(own, volume, rel_tol=1e-6)


def _cut_off(form: Form) -> Form:
    """Without what is below the ground."""
    return form if form.bottom >= 0 else replace(form, bottom=0.0, height=form.height + form.bottom)


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(value, DIGITS) + 0.0 for value in values]  # + 0.0 makes -0.0 positive
