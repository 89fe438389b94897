"""What the navigator is told when the localizer's corrections do not come as they should."""

from dataclasses import replace

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Belief


def with_correction(belief: Belief, correction: Pose2) -> Belief:
    """The belief of somebody who knows the odometry of now and a correction from map to odometry of another time."""
    odometry = belief.map_from_odom.between(belief.pose)
    return replace(belief, pose=correction.compose(odometry), map_from_odom=correction)
