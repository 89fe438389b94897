"""What the stack made of it: /amcl_pose, its particles, /plan, /local_plan, both costmaps and /cmd_vel."""

from simscen.core.geometry import Pose3
from simscen.core.messages.navigation import Belief
from simscen.core.records.trace import Decision
from simscen.record import frames, pack, pack_many, pack_rare, topics
from simscen.record.frames import RobotFrames
from simscen.record.out import Out
from simscen.record.pack_many import ParticleCloudPacker, PathPacker
from simscen.record.simtime import SimTime
from simscen.record.thinning import Thinning, Throttle

PARTICLE_RATE = 2  # a cloud of 500 is 32 kB, a third of what all other topics say in a second
POSES_RATE, MOST_POSES = 1, 200  # the same for the eye, to which 32-bit numbers are enough
LOCAL_PLAN_RATE = 5  # only for the eye


class StackTopics:
    """Writes decisions."""

    def __init__(self, out: Out, time: SimTime, thinning: Thinning, names: RobotFrames) -> None:
        self._out, self._time, self._thinning, self._names = out, time, thinning, names
        self._particles = ParticleCloudPacker(frames.MAP)
        self._path = PathPacker(frames.MAP)
        self._command = out.together([(topics.COMMAND, pack.twist())])
        self._belief = out.together([(topics.BELIEF, pack.pose_with_covariance(frames.MAP))])
        self._particle_times = Throttle(time.rate, PARTICLE_RATE)
        self._poses_times = Throttle(time.rate, POSES_RATE)
        self._local_plan_times = Throttle(time.rate, LOCAL_PLAN_RATE)

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
            self._out.publish(topic, now, pack_many.occupancy_grid(self._names.of(costmap.frame), stamp, costmap.grid))
        if self._thinning.keeps_command(tick, decision.command):
            self._command.write(now, decision.command)
        for line in decision.lines:
            self._out.publish(topics.ROSOUT, now, pack_rare.log(self._time.stamp(tick), *line))

    def _write_belief(self, now: int, tick: int, belief: Belief) -> None:
        stamp = self._time.stamp(tick)
        pose = Pose3.planar(belief.pose)
        self._belief.write(now, stamp, pose, belief.covariance.ravel().tolist())
        if len(belief.particles) and self._particle_times.passes(tick):
            self._out.publish(topics.PARTICLES, now, self._particles(stamp, belief.particles))
        if len(belief.particles) and self._poses_times.passes(tick):
            some = belief.particles[:: -(-len(belief.particles) // MOST_POSES)]
            self._out.publish(topics.PARTICLE_POSES, now, pack_many.pose_array(frames.MAP, stamp, some))
