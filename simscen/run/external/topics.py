"""The topics of the stack protocol: those of a log, and beside some of them one that keeps every bit.

A log's messages round: headings become quaternions, ranges become float32. A topic `NAME/exact` has no stamp of its
own: in one frame, its n-th message belongs to the n-th on `NAME`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from simscen.record import topics
from simscen.record.topics import Topic

POSE2D = "geometry_msgs/msg/Pose2D"
NUMBERS = "std_msgs/msg/Float64MultiArray"
EXACT = "/exact"

INITIAL_POSE = Topic("/initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped", latched=True)
KEEPOUT_MASK = Topic("/keepout_filter_mask", topics.MAP.type, latched=True)
SPEED_MASK = Topic("/speed_filter_mask", topics.MAP.type, latched=True)

HEARD = (
    *(topics.COMMAND, topics.PLAN, topics.LOCAL_PLAN, topics.BELIEF, topics.PARTICLES, topics.TF),
    *(topics.EVENTS, topics.ROSOUT),
    Topic(topics.PLAN.name + EXACT, NUMBERS),
    Topic(topics.LOCAL_PLAN.name + EXACT, NUMBERS),
    Topic(topics.BELIEF.name + EXACT, POSE2D),
    Topic(topics.PARTICLES.name + EXACT, NUMBERS),
    Topic(topics.TF.name + EXACT, POSE2D),
    *(topics.GLOBAL_COSTMAP, topics.LOCAL_COSTMAP),
)
"""What a stack may say."""


@dataclass(frozen=True)
class Offer:
    """The topics of one run, numbered: what a stack may hear (`says`) and what it may say (`hears`)."""

    says: Mapping[str, Topic]
    hears: Mapping[str, Topic]

    @classmethod
    def of(cls, says: Iterable[Topic]) -> "Offer":
        """Of these and of HEARD."""
        return cls({topic.name: topic for topic in says}, {topic.name: topic for topic in HEARD})

    @property
    def numbers(self) -> dict[str, int]:
        """The number of each topic to be heard."""
        return {name: number for number, name in enumerate(self.says, start=1)}

    @property
    def answers(self) -> dict[int, str]:
        """The topic of each number in an answer."""
        return dict(enumerate(self.hears, start=1))
