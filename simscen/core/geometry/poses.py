"""Poses in the plane and in space, in m and rad, with the axes of ROS REP 103."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
else:
    Array = object  # annotations are not evaluated; light commands do not need numpy types


_PI, _TURN = math.pi, 2 * math.pi
_cos, _sin, _remainder, _isfinite = math.cos, math.sin, math.remainder, math.isfinite
_new_pose = tuple.__new__  # faster than the constructor of the class


def wrap(angle: float) -> float:
    """Return the equivalent angle in (-π, π]."""
    wrapped = _remainder(angle, _TURN)
    return wrapped if wrapped != -_PI else _PI


def wrap_array(angles: Array) -> Array:
    """Return the equivalent angles in [-π, π)."""
    return (angles + np.pi) % (2 * np.pi) - np.pi


Vector = tuple[float, float, float]
"""(x, y, z)."""
Polygon = tuple[tuple[float, float], ...]
"""Corners (x, y) in m, in order; the last corner is connected to the first one."""


def rotate_vector(quaternion: tuple[float, float, float, float], vector: Vector) -> Vector:
    """Return `vector`, rotated by a unit quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    a, b, c = vector
    p, q, r = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a + w * p + y * r - z * q, b + w * q + z * p - x * r, c + w * r + x * q - y * p


def forward_and_left(quaternion: tuple[float, float, float, float]) -> tuple[Vector, Vector]:
    """Return the x axis and the y axis of a frame that is rotated by a unit quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)),
        (2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)),
    )


class Pose2(NamedTuple):
    """Position (m) and heading (rad) in the plane.

    As a transform, the pose of frame b in frame a is named `a_from_b`: it converts coordinates from b to a.
    """

    x: float
    y: float
    yaw: float = 0.0

    def compose(self, other: Pose2) -> Pose2:
        """Return `a_from_c` for `a_from_b.compose(b_from_c)`."""
        x, y, yaw = self
        along, left, turn = other
        c, s = _cos(yaw), _sin(yaw)
        turned = _remainder(yaw + turn, _TURN)
        return _new_pose(Pose2, (x + c * along - s * left, y + s * along + c * left, turned if turned != -_PI else _PI))

    def inverse(self) -> Pose2:
        """Return `b_from_a` for `a_from_b.inverse()`."""
        x, y, yaw = self
        c, s = _cos(yaw), _sin(yaw)
        turned = _remainder(-yaw, _TURN)
        return _new_pose(Pose2, (-c * x - s * y, s * x - c * y, turned if turned != -_PI else _PI))

    def between(self, other: Pose2) -> Pose2:
        """Return `other` in the frame of this pose: `b_from_c` for `a_from_b.between(a_from_c)`."""
        x, y, yaw = self
        far, aside, turn = other
        c, s = _cos(yaw), _sin(yaw)
        turned = _remainder(turn - yaw, _TURN)
        along, left = -c * x - s * y + c * far + s * aside, s * x - c * y - s * far + c * aside
        return _new_pose(Pose2, (along, left, turned if turned != -_PI else _PI))

    def apply(self, points: Array) -> Array:
        """Return `points_in_a` (n, 2) for `a_from_b.apply(points_in_b)`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        moved: Array = points @ np.array([[c, s], [-s, c]]) + np.array([self.x, self.y])
        return moved

    def distance(self, other: Pose2) -> float:
        """Return the distance between the two positions in m."""
        return math.hypot(other.x - self.x, other.y - self.y)


class Pose3(NamedTuple):
    """Position (m) and orientation in space, as a unit quaternion (qx, qy, qz, qw)."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    qw: float = 1.0

    @classmethod
    def from_rpy(cls, x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> Pose3:
        """Return the pose at (x, y, z) in m with fixed-axis roll, pitch and yaw in rad, as in URDF and SDF."""
        cr, sr = math.cos(roll / 2), math.sin(roll / 2)
        cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
        cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
        return cls(
            x, y, z,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )  # fmt: skip

    @classmethod
    def planar(cls, pose: Pose2, z: float = 0.0) -> Pose3:
        """Convert a pose in the plane to a level pose in space at the height `z` (m).

        If the heading is not finite, the orientation is nan.
        """
        x, y, yaw = pose
        half = yaw / 2 if _isfinite(yaw) else math.nan
        return _new_pose(cls, (x, y, z, 0.0, 0.0, _sin(half), _cos(half)))

    @property
    def position(self) -> tuple[float, float, float]:
        """(x, y, z) in m."""
        return self.x, self.y, self.z

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """(x, y, z, w), the order of ROS and PyBullet."""
        return self.qx, self.qy, self.qz, self.qw

    @property
    def is_level(self) -> bool:
        """Whether roll and pitch are 0."""
        return self.qx == 0.0 and self.qy == 0.0

    def rotation(self) -> Array:
        """Return the 3 x 3 rotation matrix."""
        x, y, z, w = self.quaternion
        (a, b, c), (d, e, f) = forward_and_left((x, y, z, w))
        return np.array([[a, d, 2 * (x * z + y * w)], [b, e, 2 * (y * z - x * w)], [c, f, 1 - 2 * (x * x + y * y)]])

    def apply(self, points: Array) -> Array:
        """Return `points_in_a` (n, 3) for `a_from_b.apply(points_in_b)`."""
        moved: Array = points @ self.rotation().T + np.array(self.position)
        return moved

    def compose(self, other: Pose3) -> Pose3:
        """Return `a_from_c` for `a_from_b.compose(b_from_c)`."""
        x, y, z = self._transform_point(other.position)
        ax, ay, az, aw = self.quaternion
        bx, by, bz, bw = other.quaternion
        return Pose3(
            x, y, z,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )  # fmt: skip

    def _transform_point(self, point: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return `point_in_a` for `a_from_b._transform_point(point_in_b)`. Faster than `apply` for level poses."""
        if self.qx != 0 or self.qy != 0:
            x, y, z = self.apply(np.array([point]))[0].tolist()
            return x, y, z
        c, s = 1 - 2 * self.qz * self.qz, 2 * self.qz * self.qw
        return c * point[0] - s * point[1] + self.x, s * point[0] + c * point[1] + self.y, point[2] + self.z

    def inverse(self) -> Pose3:
        """Return `b_from_a` for `a_from_b.inverse()`."""
        turn = Pose3(0, 0, 0, -self.qx, -self.qy, -self.qz, self.qw)
        x, y, z = (-turn.apply(np.array([self.position]))[0]).tolist()
        return turn._replace(x=x, y=y, z=z)

    @property
    def yaw(self) -> float:
        """Rotation about z in rad, in (-π, π]."""
        x, y, z, w = self.quaternion
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    @property
    def plane(self) -> Pose2:
        """The pose projected on the ground plane: x, y, and yaw."""
        return Pose2(self.x, self.y, self.yaw)
