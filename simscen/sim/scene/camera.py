"""Pictures from PyBullet's own software renderer: slow, headless, deterministic."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pybullet

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Body, Solid, TriangleMesh
from simscen.sim.bullet import engine

NEAR = 0.02
"""m in front of the lens from which on something is seen."""


def render_image(
    client: int, camera: Pose3, width: int, height: int, field_of_view: float, far: float
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
    """Colors (h, w, 3) and depths (h, w) in meters along the optical axis, inf beyond `far`.

    The camera looks along the x axis of its pose, z is up; `field_of_view` is horizontal, in rad.
    """
    eye, ahead, up = camera.apply(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])).tolist()
    over = [a - b for a, b in zip(up, eye, strict=True)]
    vertical = 2 * math.atan(math.tan(field_of_view / 2) * height / width)
    _, _, rgba, depth, _ = pybullet.getCameraImage(
        width,
        height,
        pybullet.computeViewMatrix(eye, ahead, over),
        pybullet.computeProjectionMatrixFOV(math.degrees(vertical), width / height, NEAR, far),
        shadow=0,
        renderer=pybullet.ER_TINY_RENDERER,
        flags=pybullet.ER_NO_SEGMENTATION_MASK,
        physicsClientId=client,
    )
    buffer = np.reshape(np.asarray(depth, dtype=np.float64), (height, width))
    meters = far * NEAR / (far - (far - NEAR) * buffer)
    meters[buffer >= 1.0] = np.inf
    colors = np.reshape(np.asarray(rgba, dtype=np.uint8), (height, width, 4))[:, :, :3]
    return np.ascontiguousarray(colors), meters.astype(np.float32)


# The scene for the renderer. Built with the first image, because most runs take none.
FACES_AT_ONCE = 20_000
"""Bullet's commands hold at most 131072 vertices, and here every face brings its own three."""


@dataclass(frozen=True, eq=False)
class _Prop:
    """A thing that moves: what the renderer shows of `solids`, by the engine's numbers."""

    solids: tuple[Solid, ...]
    numbers: tuple[int, ...]


class RenderScene:
    """Bodies without substance, which the renderer sees: it does not see collision shapes made of triangles."""

    def __init__(self, client: int, static: TriangleMesh, triangulate: engine.Triangulate) -> None:
        self._client, self._static, self._triangulate = client, static, triangulate
        self._begun = False
        self._props: dict[str, _Prop] = {}

    def set(self, moving: Mapping[str, tuple[Body, Pose3]]) -> None:
        """Show everything where it is now."""
        if not self._begun:
            self._begun = True
            engine.touch(self._client, engine.plane(self._client), -1, engine.NOTHING, engine.NOTHING)
            self._shown(self._static.vertices, self._static.faces)
        for name in [name for name in self._props if name not in moving]:
            self._strike(name)
        for name, (body, pose) in moving.items():
            if not engine.simple(body.solids):
                self._place(name, body, pose)

    def _place(self, name: str, body: Body, pose: Pose3) -> None:
        known = self._props.get(name)
        if known is None or known.solids is not body.solids:
            self._strike(name)
            mesh = engine.fused(body.solids, self._triangulate)
            known = self._props[name] = _Prop(body.solids, self._shown(mesh.vertices, mesh.faces))
        for number in known.numbers:
            pybullet.resetBasePositionAndOrientation(
                number, pose.position, pose.quaternion, physicsClientId=self._client
            )

    def _strike(self, name: str) -> None:
        prop = self._props.pop(name, None)
        for number in prop.numbers if prop else ():
            pybullet.removeBody(number, physicsClientId=self._client)

    def _shown(self, vertices: Array, faces: engine.Faces) -> tuple[int, ...]:
        return tuple(
            pybullet.createMultiBody(0, -1, self._visible(vertices[faces[k : k + FACES_AT_ONCE]]),
                                     physicsClientId=self._client)
            for k in range(0, len(faces), FACES_AT_ONCE)
        )  # fmt: skip

    def _visible(self, corners: Array) -> int:
        """A shape for the renderer of triangles (n, 3, 3). Every face has its own normal."""
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
