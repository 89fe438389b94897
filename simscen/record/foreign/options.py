"""Options for reading logs of real robots: topics, ground truth, and clock."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

TOPICS = {
    "odom": "/odom",
    "amcl_pose": "/amcl_pose",
    "scan": "/scan",
    "cmd_vel": "/cmd_vel",
    "plan": "/plan",
    "tf": "/tf",
    "tf_static": "/tf_static",
    "status": "/navigate_to_pose/_action/status",
}
"""Default topics by role. A role is the purpose of a topic. It is the NAME in the option `--topic NAME=TOPIC`.

The topic with the role `status` contains the states of goals.
"""

TimeSource = Literal["header", "log"]
"""Source of the times of messages: stamps in headers, or times of logging."""


@dataclass(frozen=True)
class ForeignLogOptions:
    """Options for reading the log of a real robot.

    Attributes:
        truth: Ground truth: a topic, or two frames of tf such as `map:base_link`; None without ground truth.
        topics: Topics by role, for roles whose topic is not the default.
        tick_rate: Ticks per second of the trace.
        clock: Source of the times of messages.
        same_frame: Whether the frame of the ground truth is the map frame even if their names differ.
        goals: Names of the goals of the robot, in the order in which they are accepted.
    """

    truth: str | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    tick_rate: int = 1000
    clock: TimeSource = "header"
    same_frame: bool = False
    goals: tuple[str, ...] = ()

    def topic(self, role: str) -> str:
        """Return the topic that has a role."""
        return self.topics.get(role, TOPICS[role])

    @property
    def frames(self) -> tuple[str, str] | None:
        """Parent and child frame of the ground truth; None if the ground truth is a topic or unknown."""
        return None if self.truth is None else parse_frame_pair(self.truth)


def parse_frame_pair(name: str) -> tuple[str, str] | None:
    """Return the parent and child frame of a name such as `map:base_link`; None for the name of a topic."""
    parent, colon, child = name.partition(":")
    return (parent, child) if colon and not name.startswith("/") else None
