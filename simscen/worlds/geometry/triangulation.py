"""From solids to triangles: closed surfaces with outward normals, in a deterministic order.

Physics, rays and map slices all use these triangles, so that the three can never disagree about where
a wall is.
"""

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.meshes import MAX_CONVEX_FACES
from simscen.core.geometry.shapes import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Ellipsoid,
    Extrusion,
    Mesh,
    Shape,
    Solid,
    Sphere,
    TriangleMesh,
)
from simscen.worlds.geometry.circle_facets import MAX_SAGITTA_M, facet_count

Faces = npt.NDArray[np.int32]
Profile = list[tuple[float, float]]

_BOX_CORNERS = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
_BOX_FACES = np.array(
    [
        [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
        [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5],
    ],
    dtype=np.int32,
)  # fmt: skip


def fuse(solids: Iterable[Solid]) -> TriangleMesh:
    """All solids as one triangle mesh in the frame they are placed in; face owners index `names`."""
    vertices, faces = [np.empty((0, 3))], [np.empty((0, 3), np.int32)]
    owners, names, frictions, hulls = [np.empty(0, np.int32)], [], [], list[slice | None]()
    meshes: dict[Shape, tuple[Mesh, bool]] = {}
    count = 0
    for owner, solid in enumerate(solids):
        if solid.shape not in meshes:
            mesh = triangulate(solid.shape)
            meshes[solid.shape] = mesh, len(mesh.faces) <= MAX_CONVEX_FACES and _convex(solid.shape)
        mesh, convex = meshes[solid.shape]
        vertices.append(solid.pose.apply(mesh.vertices))
        faces.append(mesh.faces + np.int32(count))
        owners.append(np.full(len(mesh.faces), owner, dtype=np.int32))
        names.append(solid.name)
        frictions.append(solid.friction)
        hulls.append(slice(count, count + len(mesh.vertices)) if convex else None)
        count += len(mesh.vertices)
    slippery = tuple(frictions) if any(friction != 1.0 for friction in frictions) else ()
    return TriangleMesh(
        np.concatenate(vertices), np.concatenate(faces), np.concatenate(owners), tuple(names), slippery, tuple(hulls)
    )


def _convex(shape: Shape) -> bool:
    """Whether a shape is convex for sure; of triangles nobody has said so."""
    match shape:
        case Mesh():
            return False
        case Extrusion(polygon):
            around = zip(polygon, polygon[1:] + polygon[:1], polygon[2:] + polygon[:2], strict=True)
            return all((bx - ax) * (cy - by) > (by - ay) * (cx - bx) for (ax, ay), (bx, by), (cx, cy) in around)
        case _:
            return True


def triangulate(shape: Shape) -> Mesh:
    """The surface of a shape about its own origin; round ones as inscribed facets, within SAGITTA."""
    match shape:
        case Box(size):
            return Mesh(_BOX_CORNERS * size, _BOX_FACES)
        case Cylinder(radius, length):
            half = length / 2
            return _revolve([(0.0, -half), (radius, -half), (radius, half), (0.0, half)], facet_count(radius))
        case Cone(radius, length):
            half = length / 2
            return _revolve([(0.0, -half), (radius, -half), (0.0, half)], facet_count(radius))
        case Sphere(radius):
            return _ellipsoid((radius, radius, radius))
        case Ellipsoid(radii):
            return _ellipsoid(radii)
        case Capsule(radius, length):
            return _capsule(radius, length)
        case Extrusion(polygon, height):
            return _prism(np.array(polygon, dtype=np.float64), height)
        case Mesh():
            return shape


def _ellipsoid(radii: tuple[float, float, float]) -> Mesh:
    # Facets of a ball are chords both along and across, so each may take half of the tolerance.
    count = facet_count(max(radii), MAX_SAGITTA_M / 2)
    angles = np.linspace(-math.pi / 2, math.pi / 2, count // 2 + 1)
    ball = _revolve(_arc(angles, 1.0, 0.0), count)
    return Mesh(ball.vertices * radii, ball.faces)


def _capsule(radius: float, length: float) -> Mesh:
    count = facet_count(radius, MAX_SAGITTA_M / 2)
    quarter = np.linspace(0.0, math.pi / 2, count // 4 + 1)
    lower = _arc(quarter - math.pi / 2, radius, -length / 2)
    return _revolve(lower + _arc(quarter, radius, length / 2)[0 if length > 0 else 1 :], count)


def _arc(angles: Array, radius: float, z: float) -> Profile:
    """Points (distance from the axis, height); the poles exactly on the axis, so that `_revolve` closes."""
    on_axis = np.abs(np.abs(angles) - math.pi / 2) < 1e-12
    distances = np.where(on_axis, 0.0, radius * np.cos(angles))
    return list(zip(distances.tolist(), (z + radius * np.sin(angles)).tolist(), strict=True))


def _revolve(profile: Profile, count: int) -> Mesh:
    """Turn a profile (distance from the axis, height), given from the bottom up, about z."""
    angles = np.arange(count) * (2 * math.pi / count)
    circle = np.column_stack((np.cos(angles), np.sin(angles), np.ones(count)))
    rings = [circle[: count if r > 0 else 1] * (r, r, z) for r, z in profile]
    starts = np.cumsum([0, *(len(ring) for ring in rings)])
    here, there, tip = np.arange(count), (np.arange(count) + 1) % count, np.zeros(count, dtype=np.int64)
    faces: list[npt.NDArray[np.int64]] = []
    for (low, high), (r_low, r_high) in zip(pairwise(starts), pairwise(r for r, _ in profile), strict=False):
        if r_low > 0:
            faces.append(np.column_stack((low + here, low + there, high + (there if r_high > 0 else tip))))
        if r_high > 0:
            faces.append(np.column_stack((low + (here if r_low > 0 else tip), high + there, high + here)))
    return Mesh(np.concatenate(rings), np.concatenate(faces).astype(np.int32))


def _prism(polygon: Array, height: float) -> Mesh:
    import mapbox_earcut

    x, y = polygon.T
    if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0:  # clockwise: written the other way round
        polygon = polygon[::-1]
    n = len(polygon)
    cap = mapbox_earcut.triangulate_float64(np.ascontiguousarray(polygon), np.array([n], dtype=np.uint32))
    top = _anticlockwise(cap.reshape(-1, 3).astype(np.int32), polygon)
    here, there = np.arange(n), (np.arange(n) + 1) % n
    lower, upper = np.column_stack((here, there, there + n)), np.column_stack((here, there + n, here + n))
    vertices = np.zeros((2 * n, 3))
    vertices[:n, :2] = vertices[n:, :2] = polygon
    vertices[n:, 2] = height
    return Mesh(vertices, np.concatenate((top[:, ::-1], top + n, lower, upper)).astype(np.int32))


def _anticlockwise(triangles: Faces, points: Array) -> Faces:
    a, b, c = points[triangles].swapaxes(0, 1)
    clockwise = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0
    result: Faces = np.where(clockwise[:, None], triangles[:, ::-1], triangles)
    return result
