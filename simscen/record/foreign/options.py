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
"""Default topics by role. A role is the NAME in `--topic NAME=TOPIC`: the use that simscen makes of a topic.

The topic with the role `status` contains the results of goals.
"""

Clock = Literal["header", "log"]
"""Source of the times of messages: the stamps in their headers, or the times at which they were logged."""


@dataclass(frozen=True)
class ForeignLogOptions:
    """Options for reading the log of a real robot.

    Attributes:
        truth: Ground truth: a topic, or two frames such as `map:base_link`. None if there is no ground truth.
        topics: Topics by role, for roles whose topic is not the default.
        tick_rate: Ticks per second of the trace.
        clock: Source of the times of messages.
        same_frame: Treat the frame of the ground truth as the map frame, even if its name differs.
        goals: Names of the goals that the robot was sent to, in order.
    """

    truth: str | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    tick_rate: int = 1000
    clock: Clock = "header"
    same_frame: bool = False
    goals: tuple[str, ...] = ()

    def topic(self, role: str) -> str:
        """Return the topic with a role in this log."""
        return self.topics.get(role, TOPICS[role])

    @property
    def frames(self) -> tuple[str, str] | None:
        """The parent and child frame if the ground truth is a transform of tf, otherwise None."""
        return None if self.truth is None else parse_frame_pair(self.truth)


def parse_frame_pair(name: str) -> tuple[str, str] | None:
    """Return the parent and child frame of a name such as `map:base_link`; None if it is the name of a topic."""
    outer, colon, inner = name.partition(":")
    return (outer, inner) if colon and not name.startswith("/") else None
