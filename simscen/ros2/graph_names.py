"""Names of simscen's topics and frames in the user's graph."""

from typing import Any, Dict, Iterable, Optional, Sequence

from simscen.ros2.messages import TF, TF_STATIC, find_type
from simscen.ros2.options import AdapterError

BASE_FRAME = "base_link"
SHARED_FRAMES = ("map", "odom")
"""Frames that cannot be renamed, because both simscen and the nodes publish transforms of them."""


class TopicNames:
    """Callable that maps topics of the stack protocol to their names in the graph.

    Remappings have the form `/scan:=/front/scan`. A new name without a leading slash is relative to the namespace.
    Topics without a remapping are moved to the namespace, except /clock. Raises AdapterError for an invalid remapping.
    """

    def __init__(self, namespace: str, remappings: Iterable[str]) -> None:
        self.namespace = "/" + namespace.strip("/") if namespace.strip("/") else ""
        self._targets: Dict[str, str] = {}
        for text in remappings:
            source, separator, target = text.partition(":=")
            if not separator or not source or not target:
                raise AdapterError(f"--remap {text}: not of the form /from:=/to")
            self._targets["/" + source.lstrip("/")] = target

    def __call__(self, topic: str) -> str:
        """Return the name in the graph of `topic`, which begins with a slash."""
        target = self._targets.get(topic)
        if target is None:
            return topic if topic == "/clock" else self.namespace + topic
        return target if target.startswith("/") else f"{self.namespace}/{target}"


class FrameNames:
    """Renames frames in the messages that simscen publishes, and gives the base frame a second name.

    Args:
        renames: Texts `FRAME:=NAME`: simscen's name, and the name in the user's graph.
        second_base: Second name of the base frame, such as base_footprint; None for no second name.

    Raises AdapterError if a text has another form, or if a frame cannot be renamed.
    """

    def __init__(self, renames: Sequence[str], second_base: Optional[str]) -> None:
        self._names: Dict[str, str] = {}
        for text in renames:
            frame, separator, name = text.partition(":=")
            if not separator or not frame or not name:
                raise AdapterError(f"--frame {text}: not of the form FRAME:=NAME")
            if frame in SHARED_FRAMES:
                raise AdapterError(f"--frame {text}: {frame} cannot be renamed, only base_link and frames of sensors")
            self._names[frame] = name
        base = self._names.get(BASE_FRAME, BASE_FRAME)
        self.base_frames = [base] if second_base in (None, BASE_FRAME, base) else [base, str(second_base)]
        """The names of the base frame in the user's graph."""

    def apply(self, topic: str, message_type: Any, data: bytes) -> bytes:
        """Return a serialized message with renamed frames. Adds the second base frame to /tf_static."""
        has_second_base = topic == TF_STATIC and len(self.base_frames) > 1
        if not has_second_base and not any(frame.encode() in data for frame in self._names):
            return data
        from rclpy.serialization import deserialize_message, serialize_message

        message = deserialize_message(data, message_type)
        parts = message.transforms if topic in (TF, TF_STATIC) else [message]
        for part in parts:
            self._rename(part)
        if has_second_base:
            parts.append(self._second_base())
        return bytes(serialize_message(message))

    def _rename(self, part: Any) -> None:
        if hasattr(part, "header"):
            part.header.frame_id = self._names.get(part.header.frame_id, part.header.frame_id)
        if hasattr(part, "child_frame_id"):
            part.child_frame_id = self._names.get(part.child_frame_id, part.child_frame_id)

    def _second_base(self) -> Any:
        """Return the identity transform from the base frame to its second name."""
        transform_type: Any = find_type("geometry_msgs/msg/TransformStamped")
        transform = transform_type()
        transform.header.frame_id, transform.child_frame_id = self.base_frames
        transform.transform.rotation.w = 1.0
        return transform
