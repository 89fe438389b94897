"""Encoders that return the bytes of ROS 2 messages: scans, images, paths, particles, transforms, grids, and others.

numpy serializes the arrays without slow Python loops.
"""

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.core.clock import Stamp
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose3
from simscen.core.messages.sensor_data import Scan
from simscen.peer.cdr import HEADER, Writer
from simscen.record.messages.template import Template

Link = tuple[str, str, Stamp, Pose3]
"""Frame, child frame, stamp, and pose of the child in the frame."""


def planar_poses(points: Array) -> Array:
    """Return poses (n, 7) of points (n, 3 or more) x, y, yaw. A pose is x, y, z and a quaternion x, y, z, w."""
    poses, halves = np.zeros((len(points), 7)), points[:, 2] / 2
    poses[:, :2] = points[:, :2]
    poses[:, 5], poses[:, 6] = np.sin(halves), np.cos(halves)
    return poses


def laser_scan(frame: str, stamp: Stamp, scan: Scan) -> bytes:
    """Return the bytes of a sensor_msgs/msg/LaserScan without intensities, which was measured at `stamp`."""
    n = len(scan.ranges)
    last = scan.angle_min + scan.angle_increment * (n - 1)
    angles = scan.angle_min, last, scan.angle_increment
    head = _header_packer(frame, "7fI")(stamp, (*angles, 0.0, 0.0, scan.range_min, scan.range_max, n))
    return head + scan.ranges.astype("<f4").tobytes() + b"\0\0\0\0"


def path(frame: str, stamp: Stamp, points: Array) -> bytes:
    """Return the bytes of a nav_msgs/msg/Path of `points` (n, 3) x, y, yaw. Every pose has the header of the path."""
    head = _header_packer(frame, "I")(stamp, (len(points),))
    if not len(points):
        return head
    poses = planar_poses(points).astype("<f8")
    # The padding of the first header differs, because `head` can have any length.
    first_header = Template(prefix=b"", start=len(head) - len(HEADER)).put("iI", *stamp).string(frame).align(8).buffer
    header = Template(prefix=b"").put("iI", *stamp).string(frame).align(8).buffer
    other_poses = np.empty((len(points) - 1, len(header) + 56), dtype=np.uint8)
    other_poses[:, : len(header)] = np.frombuffer(header, dtype=np.uint8)
    other_poses[:, len(header) :] = poses[1:].view(np.uint8).reshape(-1, 56)
    return b"".join((head, first_header, poses[0].tobytes(), other_poses.tobytes()))


def particle_cloud(frame: str, stamp: Stamp, particles: Array) -> bytes:
    """Return the bytes of a nav2_msgs/msg/ParticleCloud of `particles` (n, 4) x, y, yaw, weight; n > 0."""
    cloud = np.empty((len(particles), 8), dtype="<f8")
    cloud[:, :7] = planar_poses(particles)
    cloud[:, 7] = particles[:, 3]
    head = Writer().put("iI", *stamp).string(frame).put("I", len(particles)).align(8)
    return head.done() + cloud.tobytes()


@lru_cache(maxsize=256)
def _header_packer(frame: str, codes: str) -> Callable[..., bytes]:
    """Return a function (stamp, numbers) that packs a std_msgs/msg/Header and numbers with the given `struct` codes."""
    return Template().slot("iI", "*stamp").string(frame).slot(codes, "*numbers").packer()


def tf_message(links: Sequence[Link]) -> bytes:
    """Return the bytes of a tf2_msgs/msg/TFMessage with a transform for each link."""
    parts, start = [HEADER, struct.pack("<I", len(links))], 4
    for frame, child, stamp, pose in links:
        parts.append(_transform_packer(frame, child, start)(stamp, pose))
        start = 0
    return b"".join(parts)


@lru_cache(maxsize=1024)
def _transform_packer(frame: str, child: str, start: int) -> Callable[[Stamp, Pose3], bytes]:
    """Return a function (stamp, pose) that packs a transform.

    The transform starts `start` bytes after a multiple of eight bytes in its message.
    """
    transform = Template(prefix=b"", start=start).slot("iI", "*stamp").string(frame).string(child)
    return transform.slot("7d", "*pose").packer()


def occupancy_grid(frame: str, stamp: Stamp, grid: OccupancyGrid) -> bytes:
    """Return the bytes of a nav_msgs/msg/OccupancyGrid."""
    height, width = grid.shape
    head = (
        Writer()
        .put("iI", *stamp)
        .string(frame)
        .put("iI", *stamp)
        .put("f", grid.resolution)
        .put("2I", width, height)
        .put("7d", *Pose3.planar(grid.origin))
        .put("I", grid.cells.size)
    )
    return head.done() + grid.cells.astype(np.int8).tobytes()


def pose_array(frame: str, stamp: Stamp, points: Array) -> bytes:
    """Return the bytes of a geometry_msgs/msg/PoseArray of points (n, 3 or more) x, y, yaw; n > 0.

    The numbers are rounded to 32-bit precision.
    """
    head = Writer().put("iI", *stamp).string(frame).put("I", len(points)).align(8)
    return head.done() + planar_poses(points).astype("<f4").astype("<f8").tobytes()


def boolean(value: bool) -> bytes:
    """Return the bytes of a std_msgs/msg/Bool."""
    return Writer().put("B", value).done()


def image(frame: str, stamp: Stamp, pixels: "npt.NDArray[np.uint8] | npt.NDArray[np.float32]") -> bytes:
    """Return the bytes of a sensor_msgs/msg/Image.

    `pixels` are colors (h, w, 3), encoded as rgb8, or depths (h, w) in m, encoded as 32FC1 (REP 118).
    """
    height, width = pixels.shape[:2]
    encoding, kind = ("rgb8", "u1") if pixels.ndim == 3 else ("32FC1", "<f4")
    content = pixels.astype(kind).tobytes()
    head = (
        Writer()
        .put("iI", *stamp)
        .string(frame)
        .put("2I", height, width)
        .string(encoding)
        .put("B", 0)
        .put("2I", len(content) // height if height else 0, len(content))
    )
    return head.done() + content


Bytes = npt.NDArray[np.uint8]
"""Bytes of one message (n,) or of several messages in rows (k, n)."""


class TransformBatchPacker:
    """Callable that encodes the transforms of the same links at many times.

    For each time, the bytes are the last part of a tf2_msgs/msg/TFMessage. The caller writes the start of the message,
    with at least one transform, before this part.
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
        """Return the bytes (n, size) of the transforms at n `stamps`.

        `poses` (n, number of links, 7) are the poses of the child frames.
        """
        packed = np.tile(self._empty, (len(poses), 1))
        times, numbers = np.array(stamps, "<u4").view(np.uint8), np.ascontiguousarray(poses, "<f8").view(np.uint8)
        for column, (stamp, pose) in enumerate(self._slices):
            packed[:, stamp], packed[:, pose] = times, numbers[:, column]
        return packed


def _reserve(message: Template, codes: str) -> slice:
    """Append a slot, and return the slice of its bytes in the message."""
    message.slot(codes, "*numbers")
    end = len(message.buffer)
    return slice(end - struct.calcsize(f"<{codes}"), end)
