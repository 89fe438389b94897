"""What really happened: /clock, /ground_truth/odom, /simscen/clearance, and on /tf the robot and moving things."""

from simscen.core.trace import Truth
from simscen.record import frames, topics
from simscen.record.pack import ClockPacker, Float64Packer, OdometryPacker
from simscen.record.pack_many import TransformsPacker
from simscen.record.simtime import SimTime
from simscen.record.thinning import Thinning
from simscen.record.topics import Out


class TruthTopics:
    """Writes truth samples, and the clock with them."""

    def __init__(self, out: Out, time: SimTime, thinning: Thinning, names: frames.RobotFrames) -> None:
        self._out, self._time, self._thinning, self._frame = out, time, thinning, names.truth
        self._clock = ClockPacker()
        self._odometry = OdometryPacker(frames.MAP, names.truth)
        self._clearance = Float64Packer()
        self._transforms = TransformsPacker()

    def write(self, now: int, tick: int, truth: Truth) -> None:
        """Write the sample of `tick`, which is at `now` nanoseconds."""
        out, stamp = self._out, self._time.stamp(tick)
        out.publish(topics.CLOCK, now, self._clock(stamp))
        out.publish(topics.TRUTH, now, self._odometry(stamp, truth.pose, truth.twist))
        out.publish(topics.CLEARANCE, now, self._clearance(truth.clearance))
        links = [(frames.MAP, self._frame, stamp, truth.pose)]
        if truth.objects:
            moved = self._thinning.moved(tick, truth)
            links += [(frames.MAP, frames.of_object(name), stamp, pose) for name, pose in moved]
        out.publish(topics.TF, now, self._transforms(links))
