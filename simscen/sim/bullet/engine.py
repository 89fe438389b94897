"""Creates bodies in a PyBullet client, and sets its physics parameters.

`client` is the id of the PyBullet client. Functions that create bodies return their ids.
"""

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry import Array, Pose3, Vector
from simscen.sim.bullet import pybullet
from simscen.sim.bullet.collision_shapes import Faces, create_concave_shapes

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
Inertia = tuple[Vector, Pose3]
"""Principal moments of inertia in kg m², and the pose of the principal axes in the body frame."""


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
        enable_collisions(client, body_id)
        sleeps = pybullet.ACTIVATION_STATE_ENABLE_SLEEPING
        pybullet.changeDynamics(body_id, -1, activationState=sleeps, physicsClientId=client)
    else:
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
    pybullet.setCollisionFilterGroupMask(body_id, -1, NOTHING, NOTHING, physicsClientId=client)


def enable_collisions(client: int, body_id: int) -> None:
    """Let a body without mass collide with robots and with bodies that have a mass."""
    pybullet.setCollisionFilterGroupMask(body_id, -1, STATIC, STATIC_MASK, physicsClientId=client)


def create_static_body(
    client: int, shape: int, visual: int = DEFAULT_VISUAL, pose: Pose3 = ORIGIN, friction: float = 1.0
) -> int:
    """Create a body that never moves. It sleeps, so that objects on it can sleep as well.

    It is a Bullet rigid body instead of a multibody, because this makes each step faster.
    """
    body_id: int = pybullet.createMultiBody(
        0.0, shape, visual, pose.position, pose.quaternion, useMaximalCoordinates=1, physicsClientId=client
    )
    enable_collisions(client, body_id)
    pybullet.changeDynamics(
        body_id, -1, lateralFriction=friction, restitution=0.0, activationState=pybullet.ACTIVATION_STATE_SLEEP,
        physicsClientId=client,
    )  # fmt: skip
    return body_id


def create_static_faces(client: int, vertices: Array, faces: Faces) -> list[int]:
    """Create the triangles above the floor as a few static bodies, and return the ids of the bodies."""
    bodies = [create_static_body(client, shape) for shape in create_concave_shapes(client, vertices, faces)]
    for body in bodies:
        # Bullet would thicken the triangles by 1 mm.
        pybullet.changeDynamics(body, -1, collisionMargin=0.0, physicsClientId=client)
    return bodies


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
