"""All that a log says of one robot."""

from simscen.core.environment.scenery import Scenery
from simscen.core.geometry import Pose3
from simscen.core.records.trace import Moment
from simscen.record import frames, pack_many, pack_rare, topics
from simscen.record.event_topics import EventTopics
from simscen.record.header import LogHeader
from simscen.record.out import Namespaced, Publisher
from simscen.record.scene_topics import SceneTopics
from simscen.record.sensor_topics import SensorTopics
from simscen.record.simtime import SimTime
from simscen.record.stack_topics import StackTopics
from simscen.record.thinning import Thinning
from simscen.record.truth_topics import TruthTopics


class RobotTopics:
    """Eats the moments of a robot in the order of their ticks, and writes them to `out`; the time only with `clock`."""

    def __init__(
        self,
        out: Publisher | Namespaced,
        time: SimTime,
        about: LogHeader,
        scenery: Scenery,
        robot: str = "",
        clock: bool = True,
    ) -> None:
        self._time, names = time, frames.RobotFrames(robot)
        self.thinning = thinning = Thinning(time.rate)
        """What is kept; who keeps the same asks it, too."""
        self.settle = out.settle
        """To be called when nothing comes for a while."""
        if about.map is not None:
            out.publish(topics.MAP, 0, pack_many.occupancy_grid(frames.MAP, (0, 0), about.map))
        if about.robot_description:
            out.publish(topics.ROBOT_DESCRIPTION, 0, pack_rare.string(about.robot_description))
        self._truth = TruthTopics(out, time, thinning, names, clock)
        self._sensors = SensorTopics(out, time, thinning, about.frames, about.sensors, names)
        self._stack = StackTopics(out, time, thinning, names)
        self._events = EventTopics(out, time, about.case)
        self._scene = SceneTopics(out, about.case, scenery, names, robot)

    def append(self, moment: Moment) -> None:
        """Write one beat; every message of it carries the beat's simulated time."""
        tick, decision = moment.tick, moment.decision
        now, truth = self._time.nanoseconds(tick), moment.truth
        if truth is not None:
            self._truth.write(now, tick, truth)
        if decision.belief is not None:
            self._sensors.correct(Pose3.planar(decision.belief.map_from_odom))
        self._sensors.write(now, moment.readings)
        self._stack.write(now, tick, decision)
        if moment.events or not self._scene.begun:
            self._scene.write(now, moment.events)
        if moment.events or decision.events:
            for event in (*moment.events, *decision.events):
                self._events.write(now, event)
