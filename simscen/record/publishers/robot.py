"""What happened once: /simscen/events, /rosout and /goal_pose."""

from simscen.core.environment.scenery import Scenery
from simscen.core.geometry import Pose2, Pose3
from simscen.core.messages.navigation import Belief
from simscen.core.records.case import Case
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision, Moment
from simscen.record import frame_names, topics
from simscen.record.frame_names import RobotFrames
from simscen.record.log_header import LogHeader
from simscen.record.messages import encode, encode_arrays, event_text
from simscen.record.messages.encode_arrays import ParticleCloudPacker, PathPacker
from simscen.record.publishers.channels import LogPublisher, MessageSink, NamespacedPublisher
from simscen.record.publishers.scene import ScenePublisher
from simscen.record.publishers.sensors import SensorPublisher
from simscen.record.publishers.truth import TruthPublisher
from simscen.record.simtime import SimTime
from simscen.record.trace_thinning import Thinning, Throttle


class EventPublisher:
    """Writes events, for machines and for people; a goal that is accepted also as a pose."""

    def __init__(self, out: MessageSink, time: SimTime, case: Case) -> None:
        self._out, self._time = out, time
        self._goals = {goal.name: goal.pose for goal in case.every_goal}
        self._goal = encode.pose_stamped(frame_names.MAP).packer()

    def write(self, now: int, event: Event) -> None:
        """Write an event at `now` nanoseconds."""
        stamp, line = self._time.stamp(event.tick), event_text.sentence(event)
        self._out.publish(topics.EVENTS, now, encode.string(event_text.to_json(event)))
        self._out.publish(topics.ROSOUT, now, encode.log(stamp, event_text.level(event), "simscen", line))
        pose = self._pose(event) if event.kind == EventKind.GOAL_ACCEPTED else None
        if pose is not None:
            self._out.publish(topics.GOAL, now, self._goal(stamp, Pose3.planar(pose)))

    def _pose(self, event: Event) -> Pose2 | None:
        """Where an accepted goal is: as the event says, else as the scenario does."""
        x, y, yaw = (event.data.get(key) for key in ("x", "y", "yaw"))
        if isinstance(x, float) and isinstance(y, float):
            return Pose2(x, y, yaw if isinstance(yaw, float) else 0.0)
        return self._goals.get(event.name)


class RobotPublisher:
    """Eats the moments of a robot in the order of their ticks, and writes them to `out`; the time only with `clock`."""

    def __init__(
        self,
        out: LogPublisher | NamespacedPublisher,
        time: SimTime,
        about: LogHeader,
        scenery: Scenery,
        robot: str = "",
        clock: bool = True,
    ) -> None:
        self._time, names = time, frame_names.RobotFrames(robot)
        self.thinning = thinning = Thinning(time.rate)
        """What is kept; who keeps the same asks it, too."""
        self.settle = out.settle
        """To be called when nothing comes for a while."""
        if about.map is not None:
            out.publish(topics.MAP, 0, encode_arrays.occupancy_grid(frame_names.MAP, (0, 0), about.map))
        if about.robot_description:
            out.publish(topics.ROBOT_DESCRIPTION, 0, encode.string(about.robot_description))
        self._truth = TruthPublisher(out, time, thinning, names, clock)
        self._sensors = SensorPublisher(out, time, thinning, about.frames, about.sensors, names)
        self._stack = StackPublisher(out, time, thinning, names)
        self._events = EventPublisher(out, time, about.case)
        self._scene = ScenePublisher(out, about.case, scenery, names, robot)

    def append(self, moment: Moment) -> None:
        """Write one beat; every message of it carries the beat's simulated time."""
        tick, decision = moment.tick, moment.decision
        now, truth = self._time.nanoseconds(tick), moment.truth
        if truth is not None:
            self._truth.write(now, tick, truth)
        if decision.belief is not None:
            self._sensors.correct(Pose3.planar(decision.belief.map_from_odom))
        for odometry in decision.odometry:
            self._sensors.write_filtered(now, odometry)
        self._sensors.write(now, moment.readings)
        self._stack.write(now, tick, decision)
        if moment.events or not self._scene.begun:
            self._scene.write(now, moment.events)
        if moment.events or decision.events:
            for event in (*moment.events, *decision.events):
                self._events.write(now, event)


PARTICLE_RATE_HZ = 2  # a cloud of 500 is 32 kB, a third of what all other topics say in a second
POSE_ARRAY_RATE_HZ, MAX_ARRAY_POSES = 1, 200  # the same for the eye, to which 32-bit numbers are enough
LOCAL_PLAN_RATE_HZ = 5  # only for the eye


class StackPublisher:
    """Writes decisions."""

    def __init__(self, out: MessageSink, time: SimTime, thinning: Thinning, names: RobotFrames) -> None:
        self._out, self._time, self._thinning, self._names = out, time, thinning, names
        self._particles = ParticleCloudPacker(frame_names.MAP)
        self._path = PathPacker(frame_names.MAP)
        self._command = out.together([(topics.COMMAND, encode.twist())])
        self._belief = out.together([(topics.BELIEF, encode.pose_with_covariance(frame_names.MAP))])
        self._particle_times = Throttle(time.rate, PARTICLE_RATE_HZ)
        self._poses_times = Throttle(time.rate, POSE_ARRAY_RATE_HZ)
        self._local_plan_times = Throttle(time.rate, LOCAL_PLAN_RATE_HZ)

    def write(self, now: int, tick: int, decision: Decision) -> None:
        """Write the decision of `tick`, which is at `now` nanoseconds."""
        if decision.belief is not None:
            self._write_belief(now, tick, decision.belief)
        if decision.plan is not None:
            stamp = self._time.stamp(decision.plan.tick)
            self._out.publish(topics.PLAN, now, self._path(stamp, decision.plan.points))
        if decision.local_plan is not None and self._local_plan_times.passes(tick):
            stamp = self._time.stamp(tick)
            self._out.publish(topics.LOCAL_PLAN, now, self._path(stamp, decision.local_plan.points))
        for costmap in decision.costmaps:
            topic = topics.GLOBAL_COSTMAP if costmap.name == "global" else topics.LOCAL_COSTMAP
            stamp = self._time.stamp(tick)
            self._out.publish(
                topic, now, encode_arrays.occupancy_grid(self._names.of(costmap.frame), stamp, costmap.grid)
            )
        if self._thinning.keeps_command(tick, decision.command):
            self._command.write(now, decision.command)
        for line in decision.lines:
            self._out.publish(topics.ROSOUT, now, encode.log(self._time.stamp(tick), *line))

    def _write_belief(self, now: int, tick: int, belief: Belief) -> None:
        stamp = self._time.stamp(tick)
        pose = Pose3.planar(belief.pose)
        self._belief.write(now, stamp, pose, belief.covariance.ravel().tolist())
        if len(belief.particles) and self._particle_times.passes(tick):
            self._out.publish(topics.PARTICLES, now, self._particles(stamp, belief.particles))
        if len(belief.particles) and self._poses_times.passes(tick):
            some = belief.particles[:: -(-len(belief.particles) // MAX_ARRAY_POSES)]
            self._out.publish(topics.PARTICLE_POSES, now, encode_arrays.pose_array(frame_names.MAP, stamp, some))
