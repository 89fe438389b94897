"""Creates collision shapes and bodies in a PyBullet client, and sets its physics parameters.

`client` is the id of the PyBullet client. Functions that create shapes and bodies return their ids.
"""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import numpy.typing as npt

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.geometry.meshes import FLOOR_HEIGHT_M, submesh
from simscen.core.geometry.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere
from simscen.sim.body.outline import hull_points, reduce_hull_vertices
from simscen.sim.bullet import pybullet

MAX_FACES_PER_SHAPE = 40_000
"""Largest number of triangles in a collision shape; PyBullet refuses larger shapes."""
STRIP_WIDTH_M = 20.0
"""Width in m along x of the strips by which `split_into_tiles` sorts triangles."""
CONTACT_BREAKING_RATIO = 0.02
"""Fraction of a shape's size by which a contact point may move in a step and still count as the same point."""
REST_SPEED_SQUARED_M2_S2 = 1e-6
"""Squared speed in (m/s)² below which a body is at rest."""
SLEEP_DELAY_S = 2.0
"""Time at rest after which Bullet puts a body to sleep until it is touched."""

TERRAIN, GROUND, HULL, WHEEL, STATIC = 128, 64, 32, 16, 2
"""Collision groups: uneven ground, ground plane, hulls of robots, wheels of robots, and other bodies without mass."""
NOTHING, EVERYTHING = 0, -1
"""Collision masks of no group and of all groups."""
STATIC_MASK = ~(STATIC | GROUND | TERRAIN)
"""Collision mask of bodies without mass: all groups except STATIC, GROUND, and TERRAIN."""
DEFAULT_VISUAL = -1
"""Id of the visual shape that equals the collision shape."""
ORIGIN = Pose3()
PRIMITIVES = (Box, Cylinder, Sphere, Capsule)
"""Types of shapes that PyBullet supports without triangles."""

Triangulate = Callable[[Shape], Mesh]
"""Returns the closed surface of a shape."""
Inertia = tuple[Vector, Pose3]
"""Principal moments of inertia in kg m², and the pose of the principal axes in the body frame."""
Faces = npt.NDArray[np.int32]
"""Vertex indices (n, 3) of triangles."""


def set_physics_parameters(
    client: int, tick_rate: int, solver_iterations: int, solve_islands_separately: bool = False
) -> None:
    """Set all physics parameters of a client. `tick_rate` is in Hz.

    With `solve_islands_separately`, bodies that are not in contact have no effect on each other.
    """
    pybullet.setPhysicsEngineParameter(
        fixedTimeStep=1 / tick_rate,
        numSolverIterations=solver_iterations,
        numSubSteps=0,
        # 1e-4 would save 8 % of a step, but robots on four wheels would then creep by 0.1 mm/s.
        solverResidualThreshold=1e-7,
        erp=0.2,
        contactERP=0.2,
        frictionERP=0.2,
        globalCFM=0.0,
        restitutionVelocityThreshold=0.2,
        contactBreakingThreshold=CONTACT_BREAKING_RATIO,
        contactSlop=1e-5,
        collisionFilterMode=0,
        useSplitImpulse=0,
        enableConeFriction=1,
        enableFileCaching=0,
        deterministicOverlappingPairs=1,
        allowedCcdPenetration=0.04,
        jointFeedbackMode=0,
        constraintSolverType=pybullet.CONSTRAINT_SOLVER_LCP_SI,
        minimumSolverIslandSize=1 if solve_islands_separately else 128,
        reportSolverAnalytics=0,
        enableSAT=0,
        physicsClientId=client,
    )
    pybullet.setGravity(0, 0, -GRAVITY_M_S2, physicsClientId=client)


def set_collision_filter(client: int, body: int, link: int, group: int, mask: int) -> None:
    """Set the collision group of a link (-1: the base), and the mask of the groups that it collides with."""
    pybullet.setCollisionFilterGroupMask(body, link, group, mask, physicsClientId=client)


def create_static_faces(client: int, vertices: Array, faces: Faces) -> list[int]:
    """Create triangles as a few static bodies, and return the ids of the bodies."""
    return [_create_concave_body(client, vertices, tile) for tile in split_into_tiles(vertices, faces)]


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


def _create_concave_body(client: int, vertices: Array, faces: Faces) -> int:
    body = create_static_body(client, create_concave_shape(client, submesh(vertices, faces)))
    # Bullet would thicken the triangles by 1 mm.
    pybullet.changeDynamics(body, -1, collisionMargin=0.0, physicsClientId=client)
    return body


def create_concave_shape(client: int, mesh: Mesh) -> int:
    """Create the shape of a triangle mesh, which can be concave. It is hollow: a body inside it does not touch it."""
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


def create_compound_shape(client: int, solids: Iterable[Solid]) -> int:
    """Create one shape from solids that are all PRIMITIVES."""
    kinds, halves, radii, lengths, positions, orientations = [], [], [], [], [], []
    for solid in solids:
        kind, half, radius, length = _primitive_parameters(solid.shape)
        kinds.append(kind)
        halves.append(half)
        radii.append(radius)
        lengths.append(length)
        positions.append(solid.pose.position)
        orientations.append(solid.pose.quaternion)
    shape: int = pybullet.createCollisionShapeArray(
        shapeTypes=kinds,
        halfExtents=halves,
        radii=radii,
        lengths=lengths,
        collisionFramePositions=positions,
        collisionFrameOrientations=orientations,
        physicsClientId=client,
    )
    return _checked_shape(shape)


def create_hull_of_solids(client: int, solids: Iterable[Solid]) -> int:
    """Create the shape of the common convex hull of solids."""
    return create_convex_shape(
        client, np.concatenate([solid.pose.apply(_reduced_hull_points(solid.shape)) for solid in solids])
    )


def _reduced_hull_points(shape: Shape) -> Array:
    """Return points (n, 3) that span the convex hull of a shape; for a large mesh, only some of its vertices."""
    return reduce_hull_vertices(shape) if isinstance(shape, Mesh) else hull_points(shape)


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
    return (
        create_hull_of_solids(client, solids)
        if is_pushable
        else create_concave_shape(client, fuse_surfaces(solids, triangulate))
    )


def is_hollow(solids: Sequence[Solid], is_pushable: bool) -> bool:
    """Return whether `create_body_shape` creates a triangle mesh, which is hollow (see `create_concave_shape`)."""
    return not are_primitives(solids) and not is_pushable


def are_primitives(solids: Sequence[Solid]) -> bool:
    """Return whether the shapes of all solids are PRIMITIVES."""
    return all(isinstance(solid.shape, PRIMITIVES) for solid in solids)


def fuse_surfaces(solids: Sequence[Solid], triangulate: Triangulate) -> Mesh:
    """Return the surfaces of solids as one mesh."""
    meshes = [(triangulate(solid.shape), solid.pose) for solid in solids]
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh, _ in meshes)])
    vertices = np.concatenate([pose.apply(mesh.vertices) for mesh, pose in meshes])
    faces = [mesh.faces + np.int32(start) for (mesh, _), start in zip(meshes, starts, strict=False)]
    return Mesh(vertices, np.concatenate(faces))


def create_rigid_body(
    client: int, mass: float, shape: int, pose: Pose3, inertia: Inertia, friction: float, visual: int = DEFAULT_VISUAL
) -> int:
    """Create a body that can move, with the collision shape `shape` and the visual shape `visual`.

    `mass` is in kg. A body with mass 0 cannot be pushed, but its pose can be set.
    """
    moments, base_from_center = inertia
    center = pose.compose(base_from_center)
    body_id: int = pybullet.createMultiBody(
        mass, shape, visual, pose.position, pose.quaternion,
        baseInertialFramePosition=base_from_center.position,
        baseInertialFrameOrientation=base_from_center.quaternion, physicsClientId=client,
    )  # fmt: skip
    pybullet.changeDynamics(
        body_id, -1, lateralFriction=friction, restitution=0.0, linearDamping=0.0, angularDamping=0.0,
        physicsClientId=client,
    )  # fmt: skip
    if mass == 0:
        set_collision_filter(client, body_id, -1, STATIC, STATIC_MASK)
        sleeps = pybullet.ACTIVATION_STATE_ENABLE_SLEEPING
        pybullet.changeDynamics(body_id, -1, activationState=sleeps, physicsClientId=client)
    if mass > 0:
        pybullet.changeDynamics(body_id, -1, localInertiaDiagonal=moments, physicsClientId=client)
        pybullet.resetBasePositionAndOrientation(body_id, center.position, center.quaternion, physicsClientId=client)
    return body_id


def wake(client: int, body_id: int) -> None:
    """Wake a sleeping body. It sleeps again after SLEEP_DELAY_S at rest."""
    awake = pybullet.ACTIVATION_STATE_ENABLE_SLEEPING | pybullet.ACTIVATION_STATE_WAKE_UP
    pybullet.changeDynamics(
        body_id, -1, activationState=awake, sleepThreshold=REST_SPEED_SQUARED_M2_S2, physicsClientId=client
    )


def put_to_sleep(client: int, body_id: int) -> None:
    """Put a body to sleep after the next step, without waiting for SLEEP_DELAY_S."""
    asleep = pybullet.ACTIVATION_STATE_ENABLE_SLEEPING | pybullet.ACTIVATION_STATE_SLEEP
    pybullet.changeDynamics(
        body_id, -1, activationState=asleep, sleepThreshold=REST_SPEED_SQUARED_M2_S2, physicsClientId=client
    )


def disable_collisions(client: int, body_id: int) -> None:
    """Keep a body without mass from colliding. Distances to it can still be measured."""
    set_collision_filter(client, body_id, -1, NOTHING, NOTHING)


def enable_collisions(client: int, body_id: int) -> None:
    """Let a body without mass collide again."""
    set_collision_filter(client, body_id, -1, STATIC, STATIC_MASK)


def create_static_body(
    client: int, shape: int, visual: int = DEFAULT_VISUAL, pose: Pose3 = ORIGIN, friction: float = 1.0
) -> int:
    """Create a body that never moves. It sleeps, so that objects on it can sleep as well.

    It is a Bullet rigid body instead of a multibody, because this makes each step faster.
    """
    body_id: int = pybullet.createMultiBody(
        0.0, shape, visual, pose.position, pose.quaternion, useMaximalCoordinates=1, physicsClientId=client
    )
    set_collision_filter(client, body_id, -1, STATIC, STATIC_MASK)
    pybullet.changeDynamics(
        body_id, -1, lateralFriction=friction, restitution=0.0, activationState=pybullet.ACTIVATION_STATE_SLEEP,
        physicsClientId=client,
    )  # fmt: skip
    return body_id


def create_ground_plane(client: int, visual: int = DEFAULT_VISUAL) -> int:
    """Create the plane z = 0 as a static body."""
    return create_static_body(
        client, pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client), visual
    )


def create_invisible_shape(client: int) -> int:
    """Create a visual shape that is too small to be drawn, which saves time in simulations without images."""
    corners = [(0.0, 0.0, 0.0), (1e-9, 0.0, 0.0), (0.0, 1e-9, 0.0)]
    visual: int = pybullet.createVisualShape(
        pybullet.GEOM_MESH, vertices=corners, indices=[0, 1, 2], physicsClientId=client
    )
    return visual


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
