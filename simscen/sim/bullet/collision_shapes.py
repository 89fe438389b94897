"""Creates collision shapes in a PyBullet client.

`client` is the id of the PyBullet client. Functions that create shapes return their ids.
"""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.meshes import FLOOR_HEIGHT_M, concatenate_meshes, submesh
from simscen.core.geometry.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere
from simscen.sim.body.outline import hull_points, reduce_hull_vertices
from simscen.sim.bullet import pybullet

MAX_FACES_PER_SHAPE = 40_000
"""Largest number of triangles in a collision shape; PyBullet refuses larger shapes."""
STRIP_WIDTH_M = 20.0
"""Width in m along x of the strips by which `split_into_tiles` sorts triangles."""
PRIMITIVES = (Box, Cylinder, Sphere, Capsule)
"""Types of shapes that PyBullet supports without triangles."""

Triangulate = Callable[[Shape], Mesh]
"""Returns the closed surface of a shape."""
Faces = npt.NDArray[np.int32]
"""Vertex indices (n, 3) of triangles."""


def split_into_tiles(vertices: Array, faces: Faces) -> list[Faces]:
    """Split triangles into groups of at most MAX_FACES_PER_SHAPE that are close together."""
    if len(faces) > MAX_FACES_PER_SHAPE:
        middle = vertices[faces, :2].mean(axis=1)
        faces = faces[np.lexsort((middle[:, 1], np.floor(middle[:, 0] / STRIP_WIDTH_M)))]
    return [faces[k : k + MAX_FACES_PER_SHAPE] for k in range(0, len(faces), MAX_FACES_PER_SHAPE)]


def faces_above_floor(vertices: Array, faces: Faces) -> Faces:
    """Return the triangles that extend above the floor."""
    above: Faces = faces[(vertices[faces, 2] > FLOOR_HEIGHT_M).any(axis=1)]
    return above


def create_concave_shapes(client: int, vertices: Array, faces: Faces) -> list[int]:
    """Create the shapes of the triangles above the floor; several if there are more than MAX_FACES_PER_SHAPE."""
    tiles = split_into_tiles(vertices, faces_above_floor(vertices, faces))
    return [create_concave_shape(client, submesh(vertices, tile)) for tile in tiles]


def create_concave_shape(client: int, mesh: Mesh) -> int:
    """Create the shape of a triangle mesh, which can be concave. The shape is hollow: it touches no body inside."""
    vertices, indices = mesh.vertices.tolist(), mesh.faces.ravel().tolist()
    shape: int = pybullet.createCollisionShape(
        pybullet.GEOM_MESH,
        vertices=vertices,
        indices=indices,
        flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
        physicsClientId=client,
    )
    # PyBullet never releases these lists, which take 80 MB for a map of 220 000 triangles.
    for values in (*vertices, vertices, indices):
        values.clear()
    return _checked_shape(shape)


def create_convex_shape(client: int, corners: Array) -> int:
    """Create the shape of the convex hull of points (n, 3)."""
    shape: int = pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=corners.tolist(), physicsClientId=client)
    return _checked_shape(shape)


def create_compound_shape(client: int, solids: Sequence[Solid]) -> int:
    """Create one shape from solids that are all PRIMITIVES."""
    kinds, half_extents, radii, lengths = zip(*(_primitive_parameters(solid.shape) for solid in solids), strict=True)
    shape: int = pybullet.createCollisionShapeArray(
        shapeTypes=kinds,
        halfExtents=half_extents,
        radii=radii,
        lengths=lengths,
        collisionFramePositions=[solid.pose.position for solid in solids],
        collisionFrameOrientations=[solid.pose.quaternion for solid in solids],
        physicsClientId=client,
    )
    return _checked_shape(shape)


def create_hull_of_solids(client: int, solids: Iterable[Solid]) -> int:
    """Create the shape of the common convex hull of solids; large meshes are reduced to a part of their vertices."""
    points = [
        solid.pose.apply(
            reduce_hull_vertices(solid.shape) if isinstance(solid.shape, Mesh) else hull_points(solid.shape)
        )
        for solid in solids
    ]
    return create_convex_shape(client, np.concatenate(points))


def create_robot_shapes(client: int, solids: Sequence[Solid]) -> list[int]:
    """Create the shapes of a robot's solids: one shape for all PRIMITIVES, and one convex hull for each other solid."""
    primitives = [solid for solid in solids if isinstance(solid.shape, PRIMITIVES)]
    others = [solid for solid in solids if not isinstance(solid.shape, PRIMITIVES)]
    first = [create_compound_shape(client, primitives)] if primitives else []
    return first + [create_hull_of_solids(client, [solid]) for solid in others]


def create_body_shape(client: int, solids: Sequence[Solid], is_pushable: bool, triangulate: Triangulate) -> int:
    """Create the collision shape of a movable object.

    If all solids are PRIMITIVES, the shape consists of these primitives. If not, the shape of a pushable object is its
    convex hull, and the shape of any other object is its surface, which can be concave.
    """
    if are_primitives(solids):
        return create_compound_shape(client, solids)
    if is_pushable:
        return create_hull_of_solids(client, solids)
    return create_concave_shape(client, fuse_surfaces(solids, triangulate))


def are_primitives(solids: Sequence[Solid]) -> bool:
    """Return whether the shapes of all solids are PRIMITIVES."""
    return all(isinstance(solid.shape, PRIMITIVES) for solid in solids)


def fuse_surfaces(solids: Sequence[Solid], triangulate: Triangulate) -> Mesh:
    """Return the surfaces of solids as one mesh."""
    surfaces = [(triangulate(solid.shape), solid.pose) for solid in solids]
    return concatenate_meshes([Mesh(pose.apply(surface.vertices), surface.faces) for surface, pose in surfaces])


def _primitive_parameters(shape: Shape) -> tuple[int, Sequence[float], float, float]:
    """Return PyBullet's type of a shape from PRIMITIVES, its half extents, radius, and length in m; 0 if unused."""
    match shape:
        case Box((x, y, z)):
            return pybullet.GEOM_BOX, (x / 2, y / 2, z / 2), 0.0, 0.0
        case Cylinder(radius, length):
            return pybullet.GEOM_CYLINDER, (0.0, 0.0, 0.0), radius, length
        case Capsule(radius, length):
            return pybullet.GEOM_CAPSULE, (0.0, 0.0, 0.0), radius, length
        case Sphere(radius):
            return pybullet.GEOM_SPHERE, (0.0, 0.0, 0.0), radius, 0.0
        case _:
            raise TypeError(f"{type(shape).__name__} is not a primitive of the engine")


def _checked_shape(shape: int) -> int:
    """Return the id `shape`; raises RuntimeError if it is invalid."""
    if shape < 0:
        raise RuntimeError("PyBullet could not create a collision shape")
    return shape
