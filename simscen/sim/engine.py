"""PyBullet itself: a client with every parameter set, and collision shapes from solids."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import pybullet

from simscen.core.geometry import Pose3
from simscen.core.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere, TriangleMesh
from simscen.sim.outline import extremes

GRAVITY = 9.81
"""m/s² down."""
FACES_AT_ONCE = 40_000
"""Bullet's shared-memory commands hold at most 131072 vertices and 524288 indices."""
FLOOR = 0.005
"""Faces that lie wholly below this height in m are left to the ground plane, on which wheels roll smoothly."""

Triangulate = Callable[[Shape], Mesh]


def connect(tick_rate: int, solver_iterations: int) -> int:
    """A fresh engine without graphics; every parameter is set, so that no default decides a trajectory."""
    client: int = pybullet.connect(pybullet.DIRECT)
    if client < 0:
        raise RuntimeError("PyBullet has no free client left")
    pybullet.setPhysicsEngineParameter(
        fixedTimeStep=1 / tick_rate,
        numSolverIterations=solver_iterations,
        numSubSteps=0,
        solverResidualThreshold=1e-7,
        erp=0.2,
        contactERP=0.2,
        frictionERP=0.2,
        globalCFM=0.0,
        restitutionVelocityThreshold=0.2,
        contactBreakingThreshold=0.02,
        contactSlop=1e-5,
        collisionFilterMode=1,
        useSplitImpulse=0,
        enableConeFriction=1,
        enableFileCaching=0,
        deterministicOverlappingPairs=1,
        allowedCcdPenetration=0.04,
        jointFeedbackMode=0,
        constraintSolverType=pybullet.CONSTRAINT_SOLVER_LCP_SI,
        minimumSolverIslandSize=128,
        reportSolverAnalytics=0,
        enableSAT=0,
        physicsClientId=client,
    )
    pybullet.setGravity(0, 0, -GRAVITY, physicsClientId=client)
    return client


def ground(client: int) -> int:
    """The plane z = 0."""
    return fixed(client, pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client))


def static_mesh(client: int, mesh: TriangleMesh) -> list[int]:
    """What never moves, as few bodies: concave meshes without the faces that lie on the ground."""
    faces = mesh.faces[(mesh.vertices[mesh.faces, 2] > FLOOR).any(axis=1)]
    chunks = [faces[k : k + FACES_AT_ONCE] for k in range(0, len(faces), FACES_AT_ONCE)]
    return [_concave(client, mesh, chunk) for chunk in chunks]


def _concave(client: int, mesh: TriangleMesh, faces: "np.ndarray[tuple[int, int], np.dtype[np.int32]]") -> int:
    used, indices = np.unique(faces, return_inverse=True)
    body = fixed(client, concave_shape(client, Mesh(mesh.vertices[used], indices.reshape(-1, 3).astype(np.int32))))
    # Bullet would thicken the triangles by 1 mm.
    pybullet.changeDynamics(body, -1, collisionMargin=0.0, physicsClientId=client)
    return body


def concave_shape(client: int, mesh: Mesh) -> int:
    """Triangles as they are."""
    shape: int = pybullet.createCollisionShape(
        pybullet.GEOM_MESH,
        vertices=mesh.vertices.tolist(),
        indices=mesh.faces.ravel().tolist(),
        flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
        physicsClientId=client,
    )
    return _made(shape)


def compound_shape(client: int, solids: Iterable[Solid]) -> int:
    """One rigid shape of boxes, cylinders, balls and capsules."""
    kinds, halves, radii, lengths, places, turns = [], [], [], [], [], []
    for solid in solids:
        kind, half, radius, length = _primitive(solid.shape)
        kinds.append(kind)
        halves.append(half)
        radii.append(radius)
        lengths.append(length)
        places.append(solid.pose.position)
        turns.append(solid.pose.quaternion)
    shape: int = pybullet.createCollisionShapeArray(
        shapeTypes=kinds,
        halfExtents=halves,
        radii=radii,
        lengths=lengths,
        collisionFramePositions=places,
        collisionFrameOrientations=turns,
        physicsClientId=client,
    )
    return _made(shape)


def hull_shape(client: int, solids: Iterable[Solid]) -> int:
    """The convex hull of solids of any kind."""
    points = np.concatenate([solid.pose.apply(extremes(solid.shape)) for solid in solids])
    shape: int = pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=points.tolist(), physicsClientId=client)
    return _made(shape)


def primitive(shape: Shape) -> bool:
    """Whether the engine knows this kind of shape as such."""
    return isinstance(shape, Box | Cylinder | Sphere | Capsule)


def fixed(client: int, shape: int, pose: Pose3 = Pose3()) -> int:
    """A body that nothing pushes."""
    body: int = pybullet.createMultiBody(0, shape, -1, pose.position, pose.quaternion, physicsClientId=client)
    pybullet.changeDynamics(body, -1, lateralFriction=1.0, restitution=0.0, physicsClientId=client)
    return body


def _primitive(shape: Shape) -> tuple[int, Sequence[float], float, float]:
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


def _made(shape: int) -> int:
    if shape < 0:
        raise RuntimeError("PyBullet refused a collision shape")
    return shape
