"""Topics of the stack protocol, and kinds of errors that an external stack can cause.

ROS messages lose precision: headings become quaternions, and ranges become float32. Therefore, a topic `NAME/exact` has
the values of the topic `NAME` in full precision. In one STEP or ANSWER, the n-th messages on the two belong together.
"""

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
"""Topics on which a stack may publish, numbered from 1 in messages."""

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
