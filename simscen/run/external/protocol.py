"""The topics of the stack protocol: those of a log, and beside some of them one that keeps every bit.

A log's messages round: headings become quaternions, ranges become float32. A topic `NAME/exact` has no stamp of its
own: in one frame, its n-th message belongs to the n-th on `NAME`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from simscen.record import topics
from simscen.record.topics import Topic

POSE2D = "geometry_msgs/msg/Pose2D"
FLOAT64_ARRAY = "std_msgs/msg/Float64MultiArray"
EXACT_SUFFIX = "/exact"

INITIAL_POSE = Topic("/initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped", latched=True)
KEEPOUT_MASK = Topic("/keepout_filter_mask", topics.MAP.type, latched=True)
SPEED_MASK = Topic("/speed_filter_mask", topics.MAP.type, latched=True)

STACK_TOPICS = (
    *(topics.COMMAND, topics.PLAN, topics.LOCAL_PLAN, topics.BELIEF, topics.PARTICLES, topics.TF),
    *(topics.EVENTS, topics.ROSOUT),
    Topic(topics.PLAN.name + EXACT_SUFFIX, FLOAT64_ARRAY),
    Topic(topics.LOCAL_PLAN.name + EXACT_SUFFIX, FLOAT64_ARRAY),
    Topic(topics.BELIEF.name + EXACT_SUFFIX, POSE2D),
    Topic(topics.PARTICLES.name + EXACT_SUFFIX, FLOAT64_ARRAY),
    Topic(topics.TF.name + EXACT_SUFFIX, POSE2D),
    *(topics.GLOBAL_COSTMAP, topics.LOCAL_COSTMAP),
)
"""What a stack may say."""


@dataclass(frozen=True)
class TopicTable:
    """The topics of one run, numbered: what a stack may hear (`says`) and what it may say (`hears`)."""

    says: Mapping[str, Topic]
    hears: Mapping[str, Topic]

    @classmethod
    def of(cls, says: Iterable[Topic]) -> "TopicTable":
        """Of these and of HEARD."""
        return cls({topic.name: topic for topic in says}, {topic.name: topic for topic in STACK_TOPICS})

    @property
    def numbers(self) -> dict[str, int]:
        """The number of each topic to be heard."""
        return {name: number for number, name in enumerate(self.says, start=1)}

    @property
    def answers(self) -> dict[int, str]:
        """The topic of each number in an answer."""
        return dict(enumerate(self.hears, start=1))


# MERGED: How a run with an external stack can fail; kinds of RunError, and of errors in JUnit.
TIMEOUT = "stack-timeout"
"""No answer within its limit of wall time."""
CRASHED = "stack-crashed"
"""The process has ended, could not be started, or has hung up."""
PROTOCOL = "stack-protocol"
"""What it said is not what the protocol allows."""
FAILED = "stack-failed"
"""It said itself that it cannot go on."""


class ProtocolViolation(ValueError):
    """What a stack said is not what the protocol allows; the message says what, without who and when."""
