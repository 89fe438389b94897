"""Convert shapes to triangle meshes with outward normals and a fixed order of vertices and faces."""

import math
from collections.abc import Iterable
from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.meshes import MAX_CONVEX_FACES
from simscen.core.geometry.shapes import (
    MAX_SAGITTA_M,
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
    facet_count,
)

Profile = list[tuple[float, float]]
"""Points (distance from the z axis, height) in m, from the bottom up."""

_BOX_CORNERS = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
_BOX_FACES = np.array(
    [
        [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
        [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5],
    ],
    dtype=np.int32,
)  # fmt: skip
"""Corners (8, 3) and triangles (12, 3) of a cube of side 1 around the origin."""


def merge_solids(solids: Iterable[Solid]) -> TriangleMesh:
    """Return all solids as one triangle mesh in their common frame, in the order of the solids.

    The owner of a face is the index of its solid. Each distinct shape is triangulated only once.
    """
    vertices, faces = [np.empty((0, 3))], [np.empty((0, 3), np.int32)]
    owners, names, frictions, hulls = [np.empty(0, np.int32)], [], [], list[slice | None]()
    meshes: dict[Shape, tuple[Mesh, bool]] = {}
    vertex_count = 0
    for owner, solid in enumerate(solids):
        if solid.shape not in meshes:
            mesh = triangulate(solid.shape)
            meshes[solid.shape] = mesh, len(mesh.faces) <= MAX_CONVEX_FACES and _is_convex_by_kind(solid.shape)
        mesh, is_convex = meshes[solid.shape]
        vertices.append(solid.pose.apply(mesh.vertices))
        faces.append(mesh.faces + np.int32(vertex_count))
        owners.append(np.full(len(mesh.faces), owner, dtype=np.int32))
        names.append(solid.name)
        frictions.append(solid.friction)
        hulls.append(slice(vertex_count, vertex_count + len(mesh.vertices)) if is_convex else None)
        vertex_count += len(mesh.vertices)
    mesh_frictions = tuple(frictions) if any(friction != 1.0 for friction in frictions) else ()
    return TriangleMesh(
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate(owners),
        tuple(names),
        mesh_frictions,
        tuple(hulls),
    )


def _is_convex_by_kind(shape: Shape) -> bool:
    """Return whether a shape is convex, judged by its type or base. False for all meshes, which are not examined."""
    match shape:
        case Mesh():
            return False
        case Extrusion(polygon):
            corners = zip(polygon, polygon[1:] + polygon[:1], polygon[2:] + polygon[:2], strict=True)
            return all((bx - ax) * (cy - by) > (by - ay) * (cx - bx) for (ax, ay), (bx, by), (cx, cy) in corners)
        case _:
            return True


def triangulate(shape: Shape) -> Mesh:
    """Return the triangles of a shape in its own frame. Round shapes have inscribed facets; a mesh is unchanged."""
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
            return _extrude(np.array(polygon, dtype=np.float64), height)
        case Mesh():
            return shape


def enclosed_volume(mesh: Mesh | TriangleMesh) -> float:
    """Return the volume in m³ that a closed mesh encloses; negative if its faces point inwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


@lru_cache(maxsize=32)  # worlds repeat few sizes, and several steps of the import triangulate each solid
def _ellipsoid(radii: tuple[float, float, float]) -> Mesh:
    # Facets of a sphere are chords in two directions, so each direction may use half of the tolerance.
    count = facet_count(max(radii), MAX_SAGITTA_M / 2)
    angles = np.linspace(-math.pi / 2, math.pi / 2, count // 2 + 1)
    unit_sphere = _revolve(_arc(angles, 1.0, 0.0), count)
    return Mesh(unit_sphere.vertices * radii, unit_sphere.faces)


@lru_cache(maxsize=32)
def _capsule(radius: float, length: float) -> Mesh:
    count = facet_count(radius, MAX_SAGITTA_M / 2)
    quarter = np.linspace(0.0, math.pi / 2, count // 4 + 1)
    lower = _arc(quarter - math.pi / 2, radius, -length / 2)
    return _revolve(lower + _arc(quarter, radius, length / 2)[0 if length > 0 else 1 :], count)


def _arc(angles: Array, radius: float, z: float) -> Profile:
    """Return the points of an arc in the x-z plane. Poles are exactly on the z axis, so that `_revolve` closes them."""
    is_pole = np.abs(np.abs(angles) - math.pi / 2) < 1e-12
    distances = np.where(is_pole, 0.0, radius * np.cos(angles))
    return list(zip(distances.tolist(), (z + radius * np.sin(angles)).tolist(), strict=True))


def _revolve(profile: Profile, count: int) -> Mesh:
    """Return the surface of revolution of a profile about z, with `count` facets around the axis."""
    angles = np.arange(count) * (2 * math.pi / count)
    circle = np.column_stack((np.cos(angles), np.sin(angles), np.ones(count)))
    rings = [circle[: count if r > 0 else 1] * (r, r, z) for r, z in profile]
    ring_starts = np.cumsum([0, *(len(ring) for ring in rings)])
    # `tip` stands for both ends of a facet in a ring of only one point, which is on the axis.
    this, following, tip = np.arange(count), (np.arange(count) + 1) % count, np.zeros(count, dtype=np.int64)
    faces: list[npt.NDArray[np.int64]] = []
    for (low, high), (r_low, r_high) in zip(pairwise(ring_starts), pairwise(r for r, _ in profile), strict=False):
        if r_low > 0:
            faces.append(np.column_stack((low + this, low + following, high + (following if r_high > 0 else tip))))
        if r_high > 0:
            faces.append(np.column_stack((low + (this if r_low > 0 else tip), high + following, high + this)))
    return Mesh(np.concatenate(rings), np.concatenate(faces).astype(np.int32))


def _extrude(polygon: Array, height: float) -> Mesh:
    """Return the prism over a simple polygon (n, 2) from z = 0 to `height`."""
    import mapbox_earcut

    x, y = polygon.T
    if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0:  # clockwise
        polygon = polygon[::-1]
    n = len(polygon)
    cap = mapbox_earcut.triangulate_float64(np.ascontiguousarray(polygon), np.array([n], dtype=np.uint32))
    cap_faces = cap.reshape(-1, 3).astype(np.int32)
    a, b, c = polygon[cap_faces].swapaxes(0, 1)
    is_clockwise = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0
    cap_faces[is_clockwise] = cap_faces[is_clockwise, ::-1]
    this, following = np.arange(n), (np.arange(n) + 1) % n
    lower_sides = np.column_stack((this, following, following + n))
    upper_sides = np.column_stack((this, following + n, this + n))
    vertices = np.zeros((2 * n, 3))
    vertices[:n, :2] = vertices[n:, :2] = polygon
    vertices[n:, 2] = height
    faces = np.concatenate((cap_faces[:, ::-1], cap_faces + n, lower_sides, upper_sides))
    return Mesh(vertices, faces.astype(np.int32))
