"""What the renderer is shown: made when the first picture is taken, for most runs take none."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pybullet

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Body, Solid, TriangleMesh
from simscen.sim import engine

FACES_AT_ONCE = 20_000
"""Bullet's commands hold at most 131072 vertices, and here every face brings its own three."""


@dataclass(frozen=True, eq=False)
class _Prop:
    """A thing that moves: what the renderer shows of `solids`, by the engine's numbers."""

    solids: tuple[Solid, ...]
    numbers: tuple[int, ...]


class Film:
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
