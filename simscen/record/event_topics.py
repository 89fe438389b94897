"""What happened once: /simscen/events, /rosout and /goal_pose."""

from simscen.core.geometry import Pose2, Pose3
from simscen.core.records.case import Case
from simscen.core.records.events import Event, EventKind
from simscen.record import event_text, frames, pack, pack_rare, topics
from simscen.record.out import Out
from simscen.record.simtime import SimTime


class EventTopics:
    """Writes events, for machines and for people; a goal that is accepted also as a pose."""

    def __init__(self, out: Out, time: SimTime, case: Case) -> None:
        self._out, self._time = out, time
        self._goals = {goal.name: goal.pose for goal in case.every_goal}
        self._goal = pack.pose_stamped(frames.MAP).packer()

    def write(self, now: int, event: Event) -> None:
        """Write an event at `now` nanoseconds."""
        stamp, line = self._time.stamp(event.tick), event_text.sentence(event)
        self._out.publish(topics.EVENTS, now, pack_rare.string(event_text.to_json(event)))
        self._out.publish(topics.ROSOUT, now, pack_rare.log(stamp, event_text.level(event), "simscen", line))
        pose = self._pose(event) if event.kind == EventKind.GOAL_ACCEPTED else None
        if pose is not None:
            self._out.publish(topics.GOAL, now, self._goal(stamp, Pose3.planar(pose)))

    def _pose(self, event: Event) -> Pose2 | None:
        """Where an accepted goal is: as the event says, else as the scenario does."""
        x, y, yaw = (event.data.get(key) for key in ("x", "y", "yaw"))
        if isinstance(x, float) and isinstance(y, float):
            return Pose2(x, y, yaw if isinstance(yaw, float) else 0.0)
        return self._goals.get(event.name)
