"""Encoders of ROS 2 messages with arrays of any length: scans, paths, particles, transforms, and grids.

numpy serializes the arrays without slow Python loops.
"""

import struct
from collections.abc import Callable, Sequence
from struct import calcsize

import numpy as np
import numpy.typing as npt

from simscen.core.clock import Stamp
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose3
from simscen.core.messages.sensor_data import Scan
from simscen.peer.cdr import HEADER
from simscen.record.messages.template import Template

Link = tuple[str, str, Stamp, Pose3]
"""Frame, child frame, stamp, and pose of the child in the frame."""


def planar_poses(points: Array) -> Array:
    """Return poses (n, 7) of points (n, 3 or more) x, y, yaw. A pose is x, y, z and a quaternion x, y, z, w."""
    poses, halves = np.zeros((len(points), 7)), points[:, 2] / 2
    poses[:, :2] = points[:, :2]
    poses[:, 5], poses[:, 6] = np.sin(halves), np.cos(halves)
    return poses


class LaserScanPacker:
    """Callable encoder of sensor_msgs/msg/LaserScan without intensities."""

    def __init__(self, frame: str) -> None:
        self._pack = Template().slot("iI", "*stamp").string(frame).slot("7fI", "*numbers").packer()

    def __call__(self, stamp: Stamp, scan: Scan) -> bytes:
        """Return the bytes of a scan that was measured at `stamp`."""
        n = len(scan.ranges)
        last = scan.angle_min + scan.angle_increment * (n - 1)
        angles = scan.angle_min, last, scan.angle_increment
        head = self._pack(stamp, (*angles, 0.0, 0.0, scan.range_min, scan.range_max, n))
        return head + scan.ranges.astype("<f4").tobytes() + b"\0\0\0\0"


class PathPacker:
    """Callable encoder of nav_msgs/msg/Path. Every pose has the header of the path."""

    def __init__(self, frame: str) -> None:
        head = Template().slot("iI", "*stamp").string(frame).slot("I", "count")
        self._pack = head.packer()
        self._first = self._frame_bytes(frame, len(head.buffer) - len(HEADER))
        self._following = self._frame_bytes(frame, 0)

    @staticmethod
    def _frame_bytes(frame: str, start: int) -> bytes:
        """Return the bytes of the frame name in a geometry_msgs/msg/PoseStamped, padded to a multiple of eight bytes.

        `start` is the number of bytes of the message before the stamp.
        """
        pose = Template(prefix=b"", start=start).put("iI", 0, 0).string(frame).align(8)
        return bytes(pose.buffer[8:])

    def __call__(self, stamp: Stamp, points: Array) -> bytes:
        """Return the bytes of the path through `points` (n, 3) x, y, yaw."""
        head = self._pack(stamp, len(points))
        if not len(points):
            return head
        poses, stamp_bytes = planar_poses(points).astype("<f8"), struct.pack("<iI", *stamp)
        first, following = stamp_bytes + self._first, stamp_bytes + self._following
        rest = np.empty((len(points) - 1, len(following) + 56), dtype=np.uint8)
        rest[:, : len(following)] = np.frombuffer(following, dtype=np.uint8)
        rest[:, len(following) :] = poses[1:].view(np.uint8).reshape(-1, 56)
        return b"".join((head, first, poses[0].tobytes(), rest.tobytes()))


class ParticleCloudPacker:
    """Callable encoder of nav2_msgs/msg/ParticleCloud."""

    def __init__(self, frame: str) -> None:
        self._pack = Template().slot("iI", "*stamp").string(frame).slot("I", "count").align(8).packer()

    def __call__(self, stamp: Stamp, particles: Array) -> bytes:
        """Return the bytes of `particles` (n, 4) x, y, yaw, weight; n > 0."""
        cloud = np.empty((len(particles), 8), dtype="<f8")
        cloud[:, :7] = planar_poses(particles)
        cloud[:, 7] = particles[:, 3]
        return self._pack(stamp, len(particles)) + cloud.tobytes()


class TransformsPacker:
    """Callable encoder of tf2_msgs/msg/TFMessage."""

    def __init__(self) -> None:
        self._first_packers: dict[tuple[str, str, int], Callable[[Stamp, Pose3], bytes]] = {}
        self._following_packers: dict[tuple[str, str], Callable[[Stamp, Pose3], bytes]] = {}

    def __call__(self, links: list[Link]) -> bytes:
        """Return the bytes of one message with a transform for each link."""
        if not links:
            return HEADER + bytes(4)
        frame, child, stamp, pose = links[0]
        key = frame, child, len(links)
        pack = self._first_packers.get(key)
        if pack is None:
            pack = self._first_packers[key] = _transform_packer(frame, child, HEADER + struct.pack("<I", len(links)), 4)
        message = pack(stamp, pose)
        return message if len(links) == 1 else b"".join((message, *map(self._pack_following, links[1:])))

    def _pack_following(self, link: Link) -> bytes:
        """Return the bytes of a transform that is not the first one of its message."""
        frame, child, stamp, pose = link
        pack = self._following_packers.get((frame, child))
        if pack is None:
            pack = self._following_packers[frame, child] = _transform_packer(frame, child, b"", 0)
        return pack(stamp, pose)


def _transform_packer(frame: str, child: str, prefix: bytes, start: int) -> Callable[[Stamp, Pose3], bytes]:
    """Return a function (stamp, pose) that packs a geometry_msgs/msg/TransformStamped after the bytes `prefix`.

    The transform starts `start` bytes after a multiple of eight bytes.
    """
    return (
        Template(prefix=prefix, start=start)
        .slot("iI", "*stamp")
        .string(frame)
        .string(child)
        .slot("7d", "*pose")
        .packer()
    )


def occupancy_grid(frame: str, stamp: Stamp, grid: OccupancyGrid) -> bytes:
    """Return the bytes of a nav_msgs/msg/OccupancyGrid."""
    height, width = grid.shape
    head = (
        Template()
        .put("iI", *stamp)
        .string(frame)
        .put("iI", *stamp)
        .put("f", grid.resolution)
        .put("2I", width, height)
        .put("7d", *Pose3.planar(grid.origin))
        .put("I", grid.cells.size)
    )
    return bytes(head.buffer) + grid.cells.astype(np.int8).tobytes()


def pose_array(frame: str, stamp: Stamp, points: Array) -> bytes:
    """Return the bytes of a geometry_msgs/msg/PoseArray of points (n, 3 or more) x, y, yaw; n > 0.

    The numbers are rounded to 32-bit precision.
    """
    head = Template().put("iI", *stamp).string(frame).put("I", len(points)).align(8)
    return bytes(head.buffer) + planar_poses(points).astype("<f4").astype("<f8").tobytes()


Bytes = npt.NDArray[np.uint8]
"""Bytes of one message (n,) or of several messages in rows (k, n)."""


class TransformBatchPacker:
    """Callable encoder of the transforms of the same links at many times.

    The bytes for each time are the end of a tf2_msgs/msg/TFMessage. The caller must put another transform before them.
    """

    def __init__(self, links: Sequence[tuple[str, str]]) -> None:
        """Prepare the layout of the transforms. Each link is (frame, child frame)."""
        message = Template(prefix=b"")
        self._slices = list[tuple[slice, slice]]()
        for frame, child in links:
            stamp = _reserve(message, "iI")
            message.string(frame)
            message.string(child)
            self._slices.append((stamp, _reserve(message, "7d")))
        self._empty = np.frombuffer(message.buffer, np.uint8)
        self.size = len(self._empty)
        """Size in bytes of these transforms in one message."""

    def __call__(self, stamps: Sequence[Stamp], poses: Array) -> Bytes:
        """Return the bytes (n, size) of the transforms at n `stamps`. `poses` (n, links, 7) are of the child frames."""
        packed = np.tile(self._empty, (len(poses), 1))
        times, numbers = np.array(stamps, "<u4").view(np.uint8), np.ascontiguousarray(poses, "<f8").view(np.uint8)
        for column, (stamp, pose) in enumerate(self._slices):
            packed[:, stamp], packed[:, pose] = times, numbers[:, column]
        return packed


def _reserve(message: Template, codes: str) -> slice:
    """Append a slot, and return the slice of its bytes in the message."""
    message.slot(codes, "*numbers")
    end = len(message.buffer)
    return slice(end - calcsize(f"<{codes}"), end)
