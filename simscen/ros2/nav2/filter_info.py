"""CostmapFilterInfo messages, which describe the masks of the scenario's zones to Nav2's costmap filters.

The topics have the names of nav2_bringup (Kilted and later).
"""

from typing import Any, Callable, Dict, List, Mapping, Sequence, Tuple

from simscen.ros2.graph import Topic
from simscen.ros2.messages import find_type

MASK_TOPICS = {"/keepout_zones": "/keepout_filter_mask", "/speed_zones": "/speed_filter_mask"}
"""Topics on which the adapter publishes masks, by their topics in the stack protocol."""
INFO_TYPE = "nav2_msgs/msg/CostmapFilterInfo"
INFO_TOPICS = {
    "/keepout_filter_mask": "/keepout_costmap_filter_info",
    "/speed_filter_mask": "/speed_costmap_filter_info",
}
"""Topics of CostmapFilterInfo messages, by the topics of the masks that they describe."""
KEEPOUT, SPEED_PERCENT, SPEED_ABSOLUTE = 0, 1, 2
"""Values of CostmapFilterInfo.type, from nav2_costmap_2d/costmap_filters/filter_values.hpp."""


class FilterInfo:
    """CostmapFilterInfo messages. `masks` is the value `zone_masks` of the first message, HELLO."""

    def __init__(self, masks: Sequence[Mapping[str, Any]]) -> None:
        self._masks: Dict[str, Mapping[str, Any]] = {MASK_TOPICS[mask["topic"]]: mask for mask in masks}

    @property
    def topics(self) -> List[Topic]:
        """Topics of the messages; empty if nav2_msgs is not installed."""
        if find_type(INFO_TYPE) is None:
            return []
        return [Topic(INFO_TOPICS[mask], INFO_TYPE) for mask in self._masks]

    def messages(self, names: Callable[[str], str]) -> List[Tuple[str, bytes]]:
        """Return topics and serialized messages. `names` maps a topic to its name in the graph."""
        from rclpy.serialization import serialize_message

        found = []
        for topic, mask in self._masks.items() if self.topics else ():
            info: Any = find_type(INFO_TYPE)()  # type: ignore[misc]
            info.header.frame_id = "map"
            info.filter_mask_topic = names(topic)
            info.type, info.base, info.multiplier = KEEPOUT, 0.0, 1.0
            if mask["filter"] == "speed":
                info.type = SPEED_PERCENT if mask["percent"] else SPEED_ABSOLUTE
                info.base, info.multiplier = mask["base"], mask["multiplier"]
            found.append((INFO_TOPICS[topic], bytes(serialize_message(info))))
        return found

    def unused_masks(self, is_subscribed: Callable[[str], bool]) -> List[str]:
        """Return a warning for each mask to which no node subscribes."""
        return [
            f"no node subscribes to {topic}, so the stack does not know the {mask['filter']} zones of the scenario"
            for topic, mask in self._masks.items()
            if not is_subscribed(topic)
        ]
