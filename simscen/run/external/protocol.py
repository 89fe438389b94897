"""Topics of the stack protocol, and kinds of errors that an external stack can cause.

ROS messages lose precision: headings become quaternions, and ranges become float32. Therefore, a topic `NAME/exact` has
the values of the topic `NAME` in full precision. In one STEP or ANSWER, the n-th messages on both belong together.
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
"""Masks of the stack's costmap filters as in their files, without the zones of the scenario."""
KEEPOUT_ZONES = Topic("/keepout_zones", topics.MAP.type, latched=True)
SPEED_ZONES = Topic("/speed_zones", topics.MAP.type, latched=True)
"""Masks of the stack's costmap filters from their files, together with the enabled zones of the scenario."""

STACK_TOPICS = (
    *(topics.COMMAND, topics.PLAN, topics.LOCAL_PLAN, topics.BELIEF, topics.PARTICLES, topics.TF),
    *(topics.EVENTS, topics.ROSOUT),
    Topic(topics.PLAN.name + EXACT_SUFFIX, FLOAT64_ARRAY),
    Topic(topics.LOCAL_PLAN.name + EXACT_SUFFIX, FLOAT64_ARRAY),
    Topic(topics.BELIEF.name + EXACT_SUFFIX, POSE2D),
    Topic(topics.PARTICLES.name + EXACT_SUFFIX, FLOAT64_ARRAY),
    Topic(topics.TF.name + EXACT_SUFFIX, POSE2D),
    *(topics.GLOBAL_COSTMAP, topics.LOCAL_COSTMAP),
    *(topics.FILTERED_ODOMETRY, Topic(topics.FILTERED_ODOMETRY.name + EXACT_SUFFIX, FLOAT64_ARRAY)),
)
"""Topics on which a stack may publish."""


@dataclass(frozen=True)
class TopicTable:
    """Topics of one run by name: `sent` to the stack, and `accepted` from it. Each of the two is numbered from 1."""

    sent: Mapping[str, Topic]
    accepted: Mapping[str, Topic]

    @classmethod
    def build(cls, sent: Iterable[Topic]) -> "TopicTable":
        """Return the table with the topics `sent` to the stack. The stack may publish on STACK_TOPICS."""
        return cls({topic.name: topic for topic in sent}, {topic.name: topic for topic in STACK_TOPICS})

    @property
    def numbers(self) -> dict[str, int]:
        """Number of each topic that is sent to the stack, by name."""
        return {name: number for number, name in enumerate(self.sent, start=1)}

    @property
    def accepted_by_number(self) -> dict[int, str]:
        """Name of each topic that is accepted from the stack, by number."""
        return dict(enumerate(self.accepted, start=1))


TIMEOUT = "stack-timeout"
"""Kind of error: no answer within the limit of wall time."""
CRASHED = "stack-crashed"
"""Kind of error: the process exited, could not be started, or closed the connection."""
PROTOCOL = "stack-protocol"
"""Kind of error: a message violates the protocol."""
FAILED = "stack-failed"
"""Kind of error: the stack sent an error message."""


class ProtocolViolation(ValueError):
    """A message of a stack violates the protocol."""
