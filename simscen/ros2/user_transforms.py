"""Check of the transforms of the user's nodes, e.g. robot_state_publisher, if they replace simscen's /tf_static."""

from typing import Any, List, Set

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from simscen.ros2.graph import Graph
from simscen.ros2.graph_names import SHARED_FRAMES, FrameNames
from simscen.ros2.messages import TF, TF_STATIC, TRANSFORMS_TYPE, find_type

PROFILES = {
    TF_STATIC: QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL),
    TF: QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT),
}
"""QoS profiles of the subscriptions, by topic."""


class UserTransforms:
    """Collects the frames of the user's nodes, and finds frames of simscen's /tf_static that are missing."""

    def __init__(self, graph: Graph, names: FrameNames, tf_static: bytes) -> None:
        """Subscribe to the transforms. `tf_static` is simscen's message for /tf_static, which is not published."""
        self._required: List[str] = []
        self._published: Set[str] = set()
        message_type: Any = find_type(TRANSFORMS_TYPE)
        if message_type is None:
            return
        message = deserialize_message(names.apply(TF_STATIC, message_type, tf_static), message_type)
        self._required = [link.child_frame_id for link in message.transforms]
        for topic, profile in PROFILES.items():
            graph.node.create_subscription(message_type, graph.names(topic), self._process_transforms, profile)

    def _process_transforms(self, message: Any) -> None:
        """Add the frames of a TFMessage, except those that simscen publishes as well."""
        for link in message.transforms:
            if link.header.frame_id not in SHARED_FRAMES:  # simscen publishes odom -> base frame
                self._published |= {link.header.frame_id, link.child_frame_id}

    @property
    def robot_frames(self) -> List[str]:
        """Frames of the robot that the user's nodes publish, sorted."""
        return sorted(self._published)

    def missing_frames(self) -> List[str]:
        """Return a text for each frame of simscen's /tf_static that no node publishes."""
        known = ", ".join(self.robot_frames) or "none"
        return [
            f"no node publishes the frame {frame}, and {TF_STATIC} of simscen is left out: "
            f"--frame {frame}:=NAME uses the name of your URDF (frames of your nodes: {known})"
            for frame in self._required
            if frame not in self._published
        ]
