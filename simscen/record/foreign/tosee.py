"""What a log of others shows besides its trace: scans, particles, local plans, costmaps and the map."""

from collections.abc import Iterable, Iterator

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2, Pose3
from simscen.record import topics
from simscen.record.foreign.collected import Collected
from simscen.record.foreign.mcapfile import Raw
from simscen.record.foreign.mounts import mount_of
from simscen.record.foreign.timebase import Timebase
from simscen.record.seen import Seen

TOPICS_TO_SEE = (
    "/scan",
    *(topic.name for topic in (topics.PARTICLES, topics.LOCAL_PLAN, topics.MAP)),
    *(topic.name for topic in (topics.GLOBAL_COSTMAP, topics.LOCAL_COSTMAP)),
)
"""What is read of a bag whose other topics are left alone; an MCAP file shows lidars under any name."""
BASE = "base_link"


class Watched:
    """Keeps messages that there is something to see in, while others read them; `map` is the last map."""

    def __init__(self) -> None:
        self.map: OccupancyGrid | None = None
        self._seen = Seen(stamped=False)
        self._kept: list[Raw] = []

    def among(self, messages: Iterable[Raw]) -> Iterator[Raw]:
        """The same messages. Raises struct.error and ValueError for one that cannot be read."""
        for message in messages:
            if message.encoding == "cdr":
                self._look_at(message)
            yield message

    def seen(self, time: Timebase, found: Collected) -> Seen:
        """All of them at their ticks, with lidars where static transforms say."""
        ticks = time.of_logged(np.array([message.time for message in self._kept], dtype=np.int64))
        for tick, message in zip(ticks.tolist(), self._kept, strict=True):
            take = self._seen.taker(message.topic, message.type)
            assert take is not None
            take(tick, message.data)
        links = {posed.child: posed for _, told in found.said["tf_static"] for posed in told}
        for frame in links:
            if (mount := mount_of(frame, BASE, links)) is not None:
                self._seen.mounts[frame] = Pose3.planar(Pose2(*mount.pose))
        return self._seen

    def _look_at(self, message: Raw) -> None:
        if (message.topic, message.type) == topics.MAP[:2]:
            self.map = self._seen.costmap(message.data)[1]
        elif self._seen.taker(message.topic, message.type) is not None:
            self._try(message)
            self._kept.append(message)

    def _try(self, message: Raw) -> None:
        """Read it now: whoever looks at it later need not be ready for damage."""
        match message.type:
            case topics.SCAN_TYPE:
                self._seen.scan(message.data)
            case topics.PARTICLES.type:
                self._seen.cloud(message.data)
            case topics.LOCAL_PLAN.type:
                self._seen.path(message.data)
            case _:
                self._seen.costmap(message.data)
