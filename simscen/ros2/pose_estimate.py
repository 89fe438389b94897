"""Pose estimate and newest plan of the stack, derived from the messages of simscen and of the nodes."""

from typing import List, Optional, Tuple

from simscen.peer.messages import read
from simscen.ros2 import messages
from simscen.ros2.graph import ReceivedMessage
from simscen.ros2.messages import Pose
from simscen.ros2.options import AdapterError

MAP_FRAME, ODOM_FRAME = "map", "odom"
PLAN = "/plan"


class PoseEstimate:
    """Pose estimate and newest plan of the stack.

    The pose estimate is the transform map -> odom of /tf, composed with odometry. Without this transform, the estimate
    is /amcl_pose, or else the initial pose composed with odometry.
    """

    def __init__(self) -> None:
        self.plan: List[Tuple[float, float]] = []
        """Points (x, y) of the newest plan in m."""
        self._map_from_odom: Optional[Pose] = None
        self._amcl_pose: Optional[Pose] = None
        self._initial: Optional[Pose] = None
        self._odometry: Optional[Pose] = None

    @property
    def pose(self) -> Optional[Pose]:
        """Estimated pose in the map frame; None if unknown."""
        if self._map_from_odom is not None and self._odometry is not None:
            return messages.compose(self._map_from_odom, self._odometry)
        if self._amcl_pose is not None:
            return self._amcl_pose
        if self._initial is not None and self._odometry is not None:
            return messages.compose(self._initial, self._odometry)
        return None

    def process_published(self, topic: str, data: bytes) -> None:
        """Process a message from simscen."""
        if topic == "/odom":
            self._odometry = read("nav_msgs/msg/Odometry", data).pose
        elif topic == "/initialpose":
            self._initial = read("geometry_msgs/msg/PoseWithCovarianceStamped", data).pose

    def process_received(self, message: ReceivedMessage) -> bool:
        """Process a message from the nodes. Return False if simscen does not need it: /tf without map -> odom.

        Raises AdapterError for a pose or plan in another frame than `map`.
        """
        if message.topic == "/amcl_pose":
            _require_map_frame(message)
            self._amcl_pose = read(message.type, message.data).pose
        elif message.topic == PLAN:
            _require_map_frame(message)
            self.plan = messages.read_path(message.data)
        elif message.topic == "/tf":
            return self._process_transforms(message)
        return True

    def _process_transforms(self, message: ReceivedMessage) -> bool:
        """Store map -> odom of a message on /tf. Return whether the message contains map -> odom."""
        has_map_from_odom = False
        for link in read(message.type, message.data):
            if link.child.lstrip("/") != ODOM_FRAME:
                continue
            if link.frame.lstrip("/") != MAP_FRAME:
                raise AdapterError(f"/tf: the stack publishes {ODOM_FRAME!r} in {link.frame!r}, not in {MAP_FRAME!r}")
            self._map_from_odom = link.pose2d
            has_map_from_odom = True
        return has_map_from_odom


def _require_map_frame(message: ReceivedMessage) -> None:
    """Raise AdapterError if the message is in another frame than `map`."""
    frame = messages.read_header(message.data)[1]
    if frame.lstrip("/") != MAP_FRAME:
        raise AdapterError(f"{message.topic} is in the frame {frame!r}; simscen's map frame is {MAP_FRAME!r}")
