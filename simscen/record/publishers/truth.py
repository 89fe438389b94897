"""What really happened: /clock, /ground_truth/odom, /simscen/clearance, and on /tf the robot and moving things."""

from collections.abc import Iterable
from typing import NamedTuple

from simscen.core.geometry.scripted_poses import PosesAtTick, PredictedPoses
from simscen.core.records.trace import Truth
from simscen.record import frame_names, topics
from simscen.record.messages import encode
from simscen.record.messages.encode_arrays import Bytes, PrecomputedTransforms, TransformsPacker
from simscen.record.publishers.channels import BatchWriter, MessageSink
from simscen.record.simtime import SimTime
from simscen.record.trace_thinning import Thinning

MAX_LAYOUTS = 16
"""Sets of things that move at once, for which all messages are laid out together; most runs have few."""


class TruthPublisher:
    """Writes truth samples, and the `clock` with them unless another robot's does."""

    def __init__(
        self, out: MessageSink, time: SimTime, thinning: Thinning, names: frame_names.RobotFrames, clock: bool = True
    ) -> None:
        self._out, self._time, self._thinning, self._frame = out, time, thinning, names.truth
        truth = (topics.TRUTH, encode.odometry(frame_names.MAP, names.truth)), (topics.CLEARANCE, encode.float64())
        self._always = ((topics.CLOCK, encode.clock()), *truth) if clock else truth
        self._without = out.together(self._always)
        self._layouts: dict[tuple[str, ...], BatchWriter] = {}
        self._transforms, self._moves = TransformsPacker(), out.line(topics.TF)
        self._ahead: _PrecomputedBatch | None = None

    def write(self, now: int, tick: int, truth: Truth) -> None:
        """Write the sample of `tick`, which is at `now` nanoseconds."""
        moved = self._thinning.moved(tick, truth) if truth.objects else {}
        stamp, fields = self._time.stamp(tick), (truth.pose, truth.twist, truth.clearance)
        if type(moved) is PosesAtTick:
            ahead = self._ahead
            if ahead is None or ahead.predicted is not moved.predicted:
                ahead = self._ahead = self._lay_out(moved.predicted)
            ahead.layout.write(now, stamp, *fields, ahead.packed[moved.row].tobytes())
            return
        names = tuple(moved)
        layout = self._layouts.get(names)
        if layout is None and len(self._layouts) < MAX_LAYOUTS:
            layout = self._layouts[names] = self._layout(names)
        if layout is not None:
            layout.write(now, stamp, *fields, *moved.values())
            return
        self._without.write(now, stamp, *fields)
        links = [(frame_names.MAP, frame_names.object_frame(name), stamp, pose) for name, pose in moved.items()]
        self._moves.write(now, self._transforms([(frame_names.MAP, self._frame, stamp, truth.pose), *links]))

    def _lay_out(self, predicted: PredictedPoses) -> "_PrecomputedBatch":
        """The messages at each of its moments at which all things have moved."""
        before, names = self._ahead, predicted.names
        if before is not None and before.predicted.names == names:
            transforms, layout = before.transforms, before.layout
        else:
            transforms = PrecomputedTransforms([(frame_names.MAP, frame_names.object_frame(name)) for name in names])
            own = encode.transforms([(frame_names.MAP, self._frame, "pose")], len(names), transforms.size)
            layout = self._out.together((*self._always, (topics.TF, own)))
        stamps = [self._time.stamp(tick) for tick in predicted.ticks]
        return _PrecomputedBatch(predicted, transforms, layout, transforms(stamps, predicted.table))

    def _layout(self, moved: Iterable[str]) -> BatchWriter:
        """The messages with the poses of these things on /tf, behind the robot's."""
        links = [(frame_names.MAP, frame_names.object_frame(name), f"thing{index}") for index, name in enumerate(moved)]
        return self._out.together(
            (*self._always, (topics.TF, encode.transforms([(frame_names.MAP, self._frame, "pose"), *links])))
        )


class _PrecomputedBatch(NamedTuple):
    """All messages for things whose poses were worked out ahead, and those on /tf as they are `packed`."""

    predicted: PredictedPoses
    transforms: PrecomputedTransforms
    layout: BatchWriter
    packed: Bytes
