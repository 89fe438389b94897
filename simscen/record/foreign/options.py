"""What is looked for in a log of others, and under which names."""

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
"""The standard topics, by what `--topic NAME=TOPIC` calls them. The action's status says what became of goals."""

Clock = Literal["header", "log"]


@dataclass(frozen=True)
class ForeignLogOptions:
    """How to read a log of others.

    `truth` is what counts as the truth: a topic, or two frames as `map:base_link`; None = nothing does. `topics` are
    the names that differ from TOPICS. Times become ticks of 1/`tick_rate` s; they are those of the messages' headers,
    or when they were logged (`clock`). With `same_frame`, the truth's frame is that of the belief, whatever it is
    called. `goals` are the names of the goals that the robot was sent to, in order.
    """

    truth: str | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    tick_rate: int = 1000
    clock: Clock = "header"
    same_frame: bool = False
    goals: tuple[str, ...] = ()

    def topic(self, role: str) -> str:
        """The name of a standard topic in this log."""
        return self.topics.get(role, TOPICS[role])

    @property
    def frames(self) -> tuple[str, str] | None:
        """The frames between which tf tells the truth, outer first."""
        if self.truth is None or self.truth.startswith("/") or ":" not in self.truth:
            return None
        outer, inner = self.truth.split(":", 1)
        return outer, inner
