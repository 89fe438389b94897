"""Where the stack believes to be, from what it publishes."""

from typing import Any, List, Optional, Tuple

from simscen.ros2 import cdr, interfaces
from simscen.ros2.failure import Failure
from simscen.ros2.graph import Heard

MAP, ODOM = "map", "odom"
PLAN = "/plan"


class Belief:
    """map→odom of /tf carried on by odometry; else /amcl_pose; else the initial pose carried on by odometry."""

    def __init__(self) -> None:
        self.plan: List[Tuple[float, float]] = []
        """The points of the newest plan."""
        self._correction: Optional[cdr.Pose] = None
        self._reported: Optional[cdr.Pose] = None
        self._initial: Optional[cdr.Pose] = None
        self._odometry: Optional[cdr.Pose] = None

    @property
    def pose(self) -> Optional[cdr.Pose]:
        """x, y, yaw on the map; None while nothing says."""
        if self._correction is not None and self._odometry is not None:
            return cdr.compose(self._correction, self._odometry)
        if self._reported is not None:
            return self._reported
        if self._initial is not None and self._odometry is not None:
            return cdr.compose(self._initial, self._odometry)
        return None

    def given(self, topic: str, data: bytes) -> None:
        """Take what simscen publishes."""
        if topic == "/odom":
            self._odometry = _pose(_read("nav_msgs/msg/Odometry", data).pose.pose)
        elif topic == "/initialpose":
            self._initial = _pose(_read("geometry_msgs/msg/PoseWithCovarianceStamped", data).pose.pose)

    def heard(self, message: Heard) -> bool:
        """Take what the stack publishes; False for a /tf that says nothing of the map. A wrong frame is a Failure."""
        if message.topic == "/amcl_pose":
            _require_map(message)
            self._reported = _pose(_read(message.type, message.data).pose.pose)
        elif message.topic == PLAN:
            _require_map(message)
            self.plan = [(at.pose.position.x, at.pose.position.y) for at in _read(message.type, message.data).poses]
        elif message.topic == "/tf":
            return self._transforms(message)
        return True

    def _transforms(self, message: Heard) -> bool:
        found = False
        for link in _read(message.type, message.data).transforms:
            if link.child_frame_id.lstrip("/") == ODOM:
                if link.header.frame_id.lstrip("/") != MAP:
                    raise Failure(f"/tf: the stack places {ODOM} in {link.header.frame_id!r}, not in {MAP!r}")
                at, turn = link.transform.translation, link.transform.rotation
                self._correction = (at.x, at.y, cdr.yaw(turn.x, turn.y, turn.z, turn.w))
                found = True
        return found


def _require_map(message: Heard) -> None:
    frame = cdr.header(message.data)[1]
    if frame.lstrip("/") != MAP:
        raise Failure(f"{message.topic} comes in the frame {frame!r}; simscen's map frame is {MAP!r}")


def _read(type_: str, data: bytes) -> Any:
    from rclpy.serialization import deserialize_message

    return deserialize_message(data, interfaces.find(type_))


def _pose(pose: Any) -> cdr.Pose:
    q = pose.orientation
    return pose.position.x, pose.position.y, cdr.yaw(q.x, q.y, q.z, q.w)
