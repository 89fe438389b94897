"""The messages that a trace is made of, sorted by what they are and read."""

import struct
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from simscen.record.foreign import messages
from simscen.record.foreign.mcapfile import Raw
from simscen.record.foreign.unusable import Unusable
from simscen.record.foreign.wanted import TOPICS, Wanted

_READERS: dict[str, dict[str, Callable[[bytes], Any]]] = {
    "truth": dict(messages.POSES),
    "odom": {"nav_msgs/msg/Odometry": messages.odometry},
    "amcl_pose": dict(messages.POSES),
    "scan": {"sensor_msgs/msg/LaserScan": messages.stamp_of_scan},
    "cmd_vel": {
        "geometry_msgs/msg/Twist": messages.twist,
        "geometry_msgs/msg/TwistStamped": messages.twist_stamped,
    },
    "plan": {"nav_msgs/msg/Path": messages.path},
    "tf": {"tf2_msgs/msg/TFMessage": messages.transforms},
    "tf_static": {"tf2_msgs/msg/TFMessage": messages.transforms},
    "status": {"action_msgs/msg/GoalStatusArray": messages.goal_states},
}


@dataclass
class Collected:
    """What was read: for each role when it was logged and what it says; why a role has nothing (`lacking`)."""

    said: dict[str, list[tuple[int, Any]]] = field(default_factory=lambda: defaultdict(list))
    lacking: dict[str, str] = field(default_factory=dict)


def roles_of(wanted: Wanted) -> dict[str, list[str]]:
    """What each topic that is wanted stands for; the truth may be a topic that stands for something else, too."""
    roles: dict[str, list[str]] = defaultdict(list)
    for role in TOPICS:
        roles[wanted.topic(role)].append(role)
    if wanted.truth is not None and wanted.frames is None:
        roles[wanted.truth].append("truth")
    return dict(roles)


def collect(raw: Iterable[Raw], roles: Mapping[str, Sequence[str]]) -> Collected:
    """Read the messages of these topics. Raises Unusable for one that is not of its type."""
    found = Collected()
    for message in raw:
        for role in roles.get(message.topic, ()):
            _take(found, role, message)
    return found


def _take(found: Collected, role: str, message: Raw) -> None:
    readers = _READERS[role]
    if message.encoding != "cdr":
        found.lacking[role] = f"{message.topic} is encoded as {message.encoding or 'something unknown'}, not as CDR"
        return
    if message.type not in readers:
        expected = " or ".join(readers)
        found.lacking[role] = f"{message.topic} is a {message.type or 'type without a name'}, expected {expected}"
        return
    try:
        found.said[role].append((message.time, readers[message.type](message.data)))
    except (struct.error, ValueError, UnicodeDecodeError, OverflowError) as error:
        number = len(found.said[role]) + 1
        raise Unusable(f"message {number} of {message.topic} cannot be read as {message.type}: {error}") from error
