"""Publishers of the moments (records of single ticks) of a robot: ground truth, decisions of the stack, and events."""

from typing import NamedTuple

from simscen.core.clock import Clock
from simscen.core.environment.scenery import Scenery
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.scripted_poses import PosesAtTick, PredictedPoses
from simscen.core.messages.navigation import Belief
from simscen.core.records.case import Case
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision, Moment, Truth
from simscen.peer import messages
from simscen.record import frame_names, topics
from simscen.record.frame_names import RobotFrames
from simscen.record.log_header import LogHeader
from simscen.record.messages import encode, event_text, message_templates
from simscen.record.messages.encode import Bytes, TransformBatchPacker
from simscen.record.publishers.message_sinks import BatchWriter, LogPublisher, MessageSink
from simscen.record.publishers.scene import ScenePublisher
from simscen.record.publishers.sensors import SensorPublisher
from simscen.record.trace_thinning import Thinning, Throttle


class EventPublisher:
    """Publishes events on /simscen/events (JSON) and /rosout (text), and accepted goals on /goal_pose."""

    def __init__(self, out: MessageSink, clock: Clock, case: Case) -> None:
        self._out, self._clock = out, clock
        self._goals = {goal.name: goal.pose for goal in case.every_goal}
        self._pack_goal = message_templates.pose_stamped(frame_names.MAP).packer()

    def write(self, now: int, event: Event) -> None:
        """Publish an event. `now` is simulated time in ns."""
        stamp = self._clock.stamp(event.tick)
        line = event_text.level(event), event_text.EVENT_LOGGER, event_text.log_text(event)
        self._out.publish(topics.EVENTS, now, messages.string(event_text.to_json(event)))
        self._out.publish(topics.ROSOUT, now, messages.log(stamp, *line))
        pose = self._goal_pose(event) if event.kind == EventKind.GOAL_ACCEPTED else None
        if pose is not None:
            self._out.publish(topics.GOAL, now, self._pack_goal(stamp, Pose3.planar(pose)))

    def _goal_pose(self, event: Event) -> Pose2 | None:
        """Return the pose of an accepted goal from its event, or else from the scenario; None if it is unknown."""
        x, y, yaw = (event.data.get(key) for key in ("x", "y", "yaw"))
        if isinstance(x, float) and isinstance(y, float):
            return Pose2(x, y, yaw if isinstance(yaw, float) else 0.0)
        return self._goals.get(event.name)


class RobotPublisher:
    """Publishes the moments of a robot.

    `header` is the header of the robot, and `scenery` describes the world. `robot` is the name of the robot; "" for a
    single robot. If `publishes_clock` is True, simulated time is published on /clock.
    """

    def __init__(
        self,
        out: LogPublisher,
        clock: Clock,
        header: LogHeader,
        scenery: Scenery,
        robot: str,
        publishes_clock: bool,
    ) -> None:
        self._clock, frames = clock, RobotFrames(robot)
        self.thinning = thinning = Thinning(clock.rate, header.sensors)
        """Selects the samples to publish. A TraceBuilder of the same robot can use it as well."""
        self.flush_if_due = out.flush_if_due
        if header.map is not None:
            out.publish(topics.MAP, 0, encode.occupancy_grid(frame_names.MAP, (0, 0), header.map))
        if header.robot_description:
            out.publish(topics.ROBOT_DESCRIPTION, 0, messages.string(header.robot_description))
        self._truth = TruthPublisher(out, clock, thinning, frames, publishes_clock)
        self._sensors = SensorPublisher(out, clock, thinning, header.mounts, header.sensors, frames)
        self._stack = StackPublisher(out, clock, thinning, frames)
        self._events = EventPublisher(out, clock, header.case)
        self._scene = ScenePublisher(out, header.case, scenery, frames, robot)

    def append(self, moment: Moment) -> None:
        """Publish one moment. Moments must be published in the order of their ticks."""
        tick, decision = moment.tick, moment.decision
        now, truth = self._clock.nanoseconds(tick), moment.truth
        if truth is not None:
            self._truth.write(now, tick, truth)
        if decision.belief is not None:
            self._sensors.map_from_odom = Pose3.planar(decision.belief.map_from_odom)
        for odometry in decision.odometry:
            self._sensors.write_filtered(now, odometry)
        self._sensors.write(now, moment.readings)
        self._stack.write(now, tick, decision)
        if moment.events or not self._scene.has_published:
            self._scene.write(now, moment.events)
        if moment.events or decision.events:
            for event in (*moment.events, *decision.events):
                self._events.write(now, event)


PARTICLE_RATE_HZ = 2
"""Maximum rate of ParticleCloud messages."""
POSE_ARRAY_RATE_HZ = 1
"""Maximum rate of PoseArray messages with particles."""
MAX_ARRAY_POSES = 200
"""Maximum number of poses in a PoseArray message."""
LOCAL_PLAN_RATE_HZ = 5
"""Maximum rate of local plans."""


class StackPublisher:
    """Publishes the decisions of a stack: beliefs, plans, costmaps, commands, and log lines."""

    def __init__(self, out: MessageSink, clock: Clock, thinning: Thinning, frames: RobotFrames) -> None:
        self._out, self._clock, self._thinning, self._frames = out, clock, thinning, frames
        self._command = out.batch_writer([(topics.COMMAND, message_templates.twist())])
        self._belief = out.batch_writer([(topics.BELIEF, message_templates.pose_with_covariance(frame_names.MAP))])
        self._particle_times = Throttle(clock.rate, PARTICLE_RATE_HZ)
        self._pose_array_times = Throttle(clock.rate, POSE_ARRAY_RATE_HZ)
        self._local_plan_times = Throttle(clock.rate, LOCAL_PLAN_RATE_HZ)

    def write(self, now: int, tick: int, decision: Decision) -> None:
        """Publish the decision of `tick`. `now` is simulated time in ns."""
        if decision.belief is not None:
            self._write_belief(now, tick, decision.belief)
        if decision.plan is not None:
            stamp = self._clock.stamp(decision.plan.tick)
            self._out.publish(topics.PLAN, now, encode.path(frame_names.MAP, stamp, decision.plan.points))
        if decision.local_plan is not None and self._local_plan_times.passes(tick):
            path = encode.path(frame_names.MAP, self._clock.stamp(tick), decision.local_plan.points)
            self._out.publish(topics.LOCAL_PLAN, now, path)
        for costmap in decision.costmaps:
            topic = topics.GLOBAL_COSTMAP if costmap.name == "global" else topics.LOCAL_COSTMAP
            stamp, frame = self._clock.stamp(tick), self._frames.log_frame(costmap.frame)
            self._out.publish(topic, now, encode.occupancy_grid(frame, stamp, costmap.grid))
        if self._thinning.keeps_command(tick, decision.command):
            self._command.write(now, decision.command)
        for line in decision.lines:
            self._out.publish(topics.ROSOUT, now, messages.log(self._clock.stamp(tick), *line))

    def _write_belief(self, now: int, tick: int, belief: Belief) -> None:
        stamp = self._clock.stamp(tick)
        pose = Pose3.planar(belief.pose)
        self._belief.write(now, stamp, pose, belief.covariance.ravel().tolist())
        if len(belief.particles) and self._particle_times.passes(tick):
            cloud = encode.particle_cloud(frame_names.MAP, stamp, belief.particles)
            self._out.publish(topics.PARTICLES, now, cloud)
        if len(belief.particles) and self._pose_array_times.passes(tick):
            subset = belief.particles[:: -(-len(belief.particles) // MAX_ARRAY_POSES)]
            self._out.publish(topics.PARTICLE_POSES, now, encode.pose_array(frame_names.MAP, stamp, subset))


class TruthPublisher:
    """Publishes the ground truth: pose, velocity, and clearance of the robot, and poses of moving objects.

    /tf contains the poses. If `publishes_clock` is True, simulated time is published on /clock.
    """

    def __init__(
        self, out: MessageSink, clock: Clock, thinning: Thinning, frames: RobotFrames, publishes_clock: bool
    ) -> None:
        self._out, self._clock, self._thinning, self._frame = out, clock, thinning, frames.truth
        truth = (
            (topics.TRUTH, message_templates.odometry(frame_names.MAP, frames.truth)),
            (topics.CLEARANCE, message_templates.float64()),
        )
        self._common_layouts = ((topics.CLOCK, message_templates.clock()), *truth) if publishes_clock else truth
        robot = topics.TF, message_templates.transforms([(frame_names.MAP, self._frame, "pose")])
        self._without_tf = out.batch_writer(self._common_layouts)
        self._without_objects = out.batch_writer((*self._common_layouts, robot))
        self._object_batch: _ObjectBatch | None = None

    def write(self, now: int, tick: int, truth: Truth) -> None:
        """Publish the ground truth of `tick`. `now` is simulated time in ns."""
        poses = self._thinning.objects_to_keep(tick, truth) if truth.objects else {}
        stamp, fields = self._clock.stamp(tick), (truth.pose, truth.twist, truth.clearance)
        if type(poses) is PosesAtTick:
            batch = self._object_batch
            if batch is None or batch.predicted is not poses.predicted:
                batch = self._object_batch = self._serialize_objects(poses.predicted)
            batch.writer.write(now, stamp, *fields, batch.serialized[poses.row].tobytes())
            return
        if not poses:
            self._without_objects.write(now, stamp, *fields)
            return
        self._without_tf.write(now, stamp, *fields)
        links = [(frame_names.MAP, frame_names.object_frame(name), stamp, pose) for name, pose in poses.items()]
        robot = frame_names.MAP, self._frame, stamp, truth.pose
        self._out.publish(topics.TF, now, encode.tf_message([robot, *links]))

    def _serialize_objects(self, predicted: PredictedPoses) -> "_ObjectBatch":
        """Serialize the transforms of all objects for all ticks with predicted poses."""
        previous, names = self._object_batch, predicted.names
        if previous is not None and previous.predicted.names == names:
            packer, writer = previous.packer, previous.writer
        else:
            packer = TransformBatchPacker([(frame_names.MAP, frame_names.object_frame(name)) for name in names])
            tf = message_templates.transforms([(frame_names.MAP, self._frame, "pose")], len(names), packer.size)
            writer = self._out.batch_writer((*self._common_layouts, (topics.TF, tf)))
        stamps = [self._clock.stamp(tick) for tick in predicted.ticks]
        return _ObjectBatch(predicted, packer, writer, packer(stamps, predicted.table))


class _ObjectBatch(NamedTuple):
    """Serialized transforms of objects with predicted poses.

    predicted:   poses of the objects at several ticks
    packer:      serializer of the transforms
    writer:      writer of the transforms of one tick, together with the other messages of the tick
    serialized:  bytes of the transforms, one row for each tick
    """

    predicted: PredictedPoses
    packer: TransformBatchPacker
    writer: BatchWriter
    serialized: Bytes
