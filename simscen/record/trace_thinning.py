"""What of a run is kept: the recorder and the TraceBuilder ask here, so that log and Trace hold the same samples."""

from collections.abc import Mapping

from simscen.core.geometry import Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.scripted_poses import PosesAtTick
from simscen.core.messages.sensor_data import Odometry
from simscen.core.records.trace import Truth

COMMAND_RATE_HZ = 20
STANDSTILL_RATE_HZ = 1


class Thinning:
    """Drops what says nothing new, on a clock of `rate` ticks a second.

    A command is kept when it differs from the last one, and else 20 times a second. The pose of a moving thing is
    kept when it has changed, and else once a second. Of several odometries the first that speaks is the robot's.
    Whoever asks again about the tick that was last asked about is told the same.
    """

    def __init__(self, rate: int) -> None:
        self._command_period = max(1, rate // COMMAND_RATE_HZ)
        self._standstill_period = max(1, rate // STANDSTILL_RATE_HZ)
        self._command: Twist | None = None
        self._commanded = 0
        self._asked = -1
        self._objects: dict[str, tuple[int, Pose3]] = {}
        self._odometry: str | None = None
        self._at_rest: Mapping[str, Pose3] | None = None
        self._due = 0
        self._moved_at = -1
        self._moved: Mapping[str, Pose3] = {}
        self._whole: tuple[int, PosesAtTick] | None = None
        """The sample before, if all things of it are kept: `_objects` does not know of it yet."""

    def keeps_command(self, tick: int, command: Twist) -> bool:
        """Whether the command of this beat is kept."""
        if tick != self._asked:
            self._asked = tick
            if command != self._command or tick - self._commanded >= self._command_period:
                self._command, self._commanded = command, tick
        return self._commanded == tick

    def keeps_odometry(self, odometry: Odometry) -> bool:
        """Whether this is the robot's own odometry."""
        if self._odometry is None:
            self._odometry = odometry.sensor
        return odometry.sensor == self._odometry

    def moved(self, tick: int, truth: Truth) -> Mapping[str, Pose3]:
        """The moving things whose pose is kept at this tick, by name."""
        if tick != self._moved_at:
            self._moved_at, self._moved = tick, self._kept(tick, truth)
        return self._moved

    def _kept(self, tick: int, truth: Truth) -> Mapping[str, Pose3]:
        objects = truth.objects
        if type(objects) is PosesAtTick and self._all_moved(objects):
            self._whole, self._at_rest = (tick, objects), objects
            return objects
        if self._whole is not None:
            before, places = self._whole
            self._objects.update({name: (before, pose) for name, pose in places.items()})
        kept = self._each(tick, objects)
        self._whole = (tick, objects) if type(objects) is PosesAtTick and len(kept) == len(objects) else None
        return kept

    def _all_moved(self, objects: PosesAtTick) -> bool:
        """Whether everything is elsewhere than in the sample before, of which everything is kept."""
        if self._whole is None:
            return False
        before, seen = self._whole[1], objects.predicted
        return before.predicted is seen and before.row == objects.row - 1 and seen.all_moved[objects.row]

    def _each(self, tick: int, objects: Mapping[str, Pose3]) -> dict[str, Pose3]:
        kept = dict[str, Pose3]()
        at_rest = objects is self._at_rest  # nothing has moved since the sample before
        if at_rest and tick < self._due:
            return kept
        for name, pose in objects.items():
            last = self._objects.get(name)
            if last is None or last[1] != pose or tick - last[0] >= self._standstill_period:
                self._objects[name] = (tick, pose)
                kept[name] = pose
        self._at_rest = objects
        self._due = 0
        if at_rest:
            self._due = min([self._objects[name][0] for name in objects], default=tick) + self._standstill_period
        return kept


class Throttle:
    """Lets pass what comes at least a period of `rate` hertz after what passed before."""

    def __init__(self, ticks_per_second: int, rate: int) -> None:
        self._period = max(1, ticks_per_second // rate)
        self._next: int | None = None

    def passes(self, tick: int) -> bool:
        """Whether it is time."""
        if self._next is not None and tick < self._next:
            return False
        self._next = tick + self._period
        return True
