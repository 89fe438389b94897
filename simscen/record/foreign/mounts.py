"""Where a lidar is on its robot, by the chain of static transforms."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from simscen.core.geometry import Pose3
from simscen.record.foreign.messages import Posed
from simscen.record.foreign.sensedrows import Triple

_BASES = ("base_link", "base_footprint")


class Mount(NamedTuple):
    """x, y, yaw of a lidar on the base, and whether it hangs upside down, so that it counts angles the other way."""

    pose: Triple
    hangs: bool


def mount_of(frame: str, base: str, links: Mapping[str, Posed]) -> Mount | None:
    """Where `frame` is on the frame that odometry moves, else on what is called base_link; None where none says so."""
    pose, seen, nearest = Pose3(0, 0, 0, 0, 0, 0, 1), set(), None
    while True:
        if frame == base:
            return _on_the_plane(pose)
        if nearest is None and frame.rpartition("/")[2] in _BASES:
            nearest = _on_the_plane(pose)
        if frame not in links or frame in seen:
            return nearest
        seen.add(frame)
        link = links[frame]
        pose, frame = Pose3(*link.pose).compose(pose), link.frame


def _on_the_plane(pose: Pose3) -> Mount:
    qx, qy, qz, qw = pose.quaternion
    x, y, _ = pose.position
    yaw = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
    return Mount((x, y, yaw), 1 - 2 * (qx * qx + qy * qy) < 0)
