"""Camera images from PyBullet's software renderer, which needs no display and is deterministic."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Body, Solid, TriangleMesh
from simscen.sim.bullet import collision_shapes, engine, pybullet
from simscen.sim.bullet.collision_shapes import Triangulate

NEAR_PLANE_M = 0.02
"""Distance from the camera below which nothing is rendered."""
MAX_FACES_PER_VISUAL_SHAPE = 20_000
"""Largest number of triangles in a visual shape."""


def render_image(
    client: int, camera: Pose3, width: int, height: int, field_of_view: float, far: float
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
    """Return colors (height, width, 3) and depths (height, width) in m along the optical axis, inf beyond `far` m.

    `camera` is the pose of the camera in the world frame: x is the optical axis, and z points up in the image. `width`
    and `height` are in pixels. `field_of_view` is horizontal, in rad.
    """
    eye, target, above = camera.apply(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])).tolist()
    up = [a - b for a, b in zip(above, eye, strict=True)]
    vertical_field_of_view = 2 * math.atan(math.tan(field_of_view / 2) * height / width)
    _, _, rgba, depth, _ = pybullet.getCameraImage(
        width,
        height,
        pybullet.computeViewMatrix(eye, target, up),
        pybullet.computeProjectionMatrixFOV(math.degrees(vertical_field_of_view), width / height, NEAR_PLANE_M, far),
        shadow=0,
        renderer=pybullet.ER_TINY_RENDERER,
        flags=pybullet.ER_NO_SEGMENTATION_MASK,
        physicsClientId=client,
    )
    buffer = np.reshape(np.asarray(depth, dtype=np.float64), (height, width))
    meters = far * NEAR_PLANE_M / (far - (far - NEAR_PLANE_M) * buffer)
    meters[buffer >= 1.0] = np.inf
    colors = np.reshape(np.asarray(rgba, dtype=np.uint8), (height, width, 4))[:, :, :3]
    return np.ascontiguousarray(colors), meters.astype(np.float32)


@dataclass(frozen=True, eq=False)
class _VisualBody:
    """Solids of a movable object, and the ids of the bodies that show them."""

    solids: tuple[Solid, ...]
    body_ids: tuple[int, ...]


class RenderScene:
    """Visual bodies of all triangle meshes: the static world, and movable objects that are not PyBullet primitives.

    PyBullet's renderer does not show collision shapes that are triangle meshes. The visual bodies are created with the
    first image.
    """

    def __init__(self, client: int, static: TriangleMesh, triangulate: Triangulate) -> None:
        self._client, self._static, self._triangulate = client, static, triangulate
        self._is_built = False
        self._visuals: dict[str, _VisualBody] = {}

    def update(self, objects: Mapping[str, tuple[Body, Pose3]]) -> None:
        """Show the movable objects, given by name with their current poses; remove all other movable objects."""
        if not self._is_built:
            self._is_built = True
            engine.disable_collisions(self._client, engine.create_ground_plane(self._client))
            self._create_bodies(self._static.vertices, self._static.faces)
        for name in [name for name in self._visuals if name not in objects]:
            self._remove(name)
        for name, (body, pose) in objects.items():
            if not collision_shapes.are_primitives(body.solids):
                self._place(name, body, pose)

    def _place(self, name: str, body: Body, pose: Pose3) -> None:
        """Create the visual bodies of an object if they are missing, and move them to `pose`."""
        known = self._visuals.get(name)
        if known is None or known.solids is not body.solids:
            self._remove(name)
            mesh = collision_shapes.fuse_surfaces(body.solids, self._triangulate)
            known = self._visuals[name] = _VisualBody(body.solids, self._create_bodies(mesh.vertices, mesh.faces))
        for body_id in known.body_ids:
            pybullet.resetBasePositionAndOrientation(
                body_id, pose.position, pose.quaternion, physicsClientId=self._client
            )

    def _remove(self, name: str) -> None:
        """Remove the visual bodies of an object, if any."""
        visual = self._visuals.pop(name, None)
        for body_id in visual.body_ids if visual else ():
            pybullet.removeBody(body_id, physicsClientId=self._client)

    def _create_bodies(self, vertices: Array, faces: collision_shapes.Faces) -> tuple[int, ...]:
        """Create visual bodies of triangles; return their ids."""
        return tuple(
            pybullet.createMultiBody(0, -1, self._create_shape(vertices[faces[k : k + MAX_FACES_PER_VISUAL_SHAPE]]),
                                     physicsClientId=self._client)
            for k in range(0, len(faces), MAX_FACES_PER_VISUAL_SHAPE)
        )  # fmt: skip

    def _create_shape(self, corners: Array) -> int:
        """Create a visual shape of triangles (n, 3, 3) with flat shading; return its id."""
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        shape: int = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=corners.reshape(-1, 3).tolist(),
            indices=list(range(3 * len(corners))),
            normals=np.repeat(normals, 3, axis=0).tolist(),
            physicsClientId=self._client,
        )
        return shape
