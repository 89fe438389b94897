"""Quality of service: what simscen offers on each topic, and what it asks of the topics that it hears."""

from typing import Any, List, Sequence, Tuple

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

LATCHED = frozenset({"/map", "/tf_static", "/robot_description"})
"""Transient local: whoever comes later gets the last message."""
DEEP = {"/tf": 100, "/imu": 100}
"""How many messages are kept for a slow subscriber; 10 of all others."""


def offered(topic: str) -> QoSProfile:
    """What a topic of simscen's is published with: reliable, which suits every subscriber."""
    latched = topic in LATCHED
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=1 if latched else DEEP.get(topic, 10),
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def heard(publishers: Sequence[Any]) -> QoSProfile:
    """What suits all of a topic's publishers: reliable where all are. Latched ones are heard from their last on."""
    profiles = [publisher.qos_profile for publisher in publishers]
    reliable = all(profile.reliability == ReliabilityPolicy.RELIABLE for profile in profiles)
    latched = bool(profiles) and all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in profiles)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=100,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def misfits(offer: QoSProfile, wanted: QoSProfile) -> List[Tuple[str, str, str]]:
    """The policies for which `wanted` hears nothing of `offer`: (policy, what is offered, what is wanted)."""
    found = []
    if wanted.reliability == ReliabilityPolicy.RELIABLE and offer.reliability == ReliabilityPolicy.BEST_EFFORT:
        found.append(("reliability", "best effort", "reliable"))
    if wanted.durability == DurabilityPolicy.TRANSIENT_LOCAL and offer.durability == DurabilityPolicy.VOLATILE:
        found.append(("durability", "volatile", "transient local"))
    return found
