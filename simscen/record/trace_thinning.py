"""Selection of the samples of a run that the log and the Trace contain."""

from collections.abc import Mapping
from types import MappingProxyType

from simscen.core.geometry import Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.scripted_poses import PosesAtTick
from simscen.core.messages.sensor_data import Odometry
from simscen.core.records.trace import Truth

COMMAND_RATE_HZ = 20
"""Rate at which an unchanged command is kept."""
STANDSTILL_RATE_HZ = 1
"""Rate at which an unchanged pose of an object is kept."""


class Thinning:
    """Selects the samples to keep. `tick_rate` is the number of ticks per second.

    Changed commands and changed poses of objects are always kept. Odometry is kept only from one sensor: the first
    odometry sensor in `sensors`, or else the sensor of the first odometry reading. `sensors` are the class names of
    readings ("Odometry", …) by sensor name.

    Repeated calls for the same tick return the same result.
    """

    def __init__(self, tick_rate: int, sensors: Mapping[str, str] = MappingProxyType({})) -> None:
        self._command_period = max(1, tick_rate // COMMAND_RATE_HZ)
        self._standstill_period = max(1, tick_rate // STANDSTILL_RATE_HZ)
        self._command: Twist | None = None
        self._command_kept_tick = 0
        self._command_checked_tick = -1
        self._odometry_sensor = next((name for name, kind in sensors.items() if kind == Odometry.__name__), None)
        self._kept_poses: dict[str, tuple[int, Pose3]] = {}
        """Last kept pose of each object, with its tick, by object name."""
        self._previous_poses: Mapping[str, Pose3] | None = None
        """Poses of the previous sample. If the next sample is the same Python object, nothing has moved."""
        self._standstill_due_tick = 0
        """Tick from which the poses of stationary objects must be checked again."""
        self._selected_tick = -1
        self._selected: Mapping[str, Pose3] = {}
        self._all_kept: tuple[int, PosesAtTick] | None = None
        """Tick and poses of the previous sample if all its poses were kept. Added to `_kept_poses` only if needed."""

    def keeps_command(self, tick: int, command: Twist) -> bool:
        """Return whether to keep the command of this tick."""
        if tick != self._command_checked_tick:
            self._command_checked_tick = tick
            if command != self._command or tick - self._command_kept_tick >= self._command_period:
                self._command, self._command_kept_tick = command, tick
        return self._command_kept_tick == tick

    def keeps_odometry(self, odometry: Odometry) -> bool:
        """Return whether to keep an odometry reading."""
        if self._odometry_sensor is None:
            self._odometry_sensor = odometry.sensor
        return odometry.sensor == self._odometry_sensor

    def objects_to_keep(self, tick: int, truth: Truth) -> Mapping[str, Pose3]:
        """Return the poses of objects to keep at this tick, by object name."""
        if tick != self._selected_tick:
            self._selected_tick, self._selected = tick, self._select_objects(tick, truth.objects)
        return self._selected

    def _select_objects(self, tick: int, objects: Mapping[str, Pose3]) -> Mapping[str, Pose3]:
        """Return the poses to keep. If all objects have moved, skip the comparison of single poses."""
        if type(objects) is PosesAtTick and self._have_all_moved(objects):
            self._all_kept, self._previous_poses = (tick, objects), objects
            return objects
        if self._all_kept is not None:
            previous_tick, poses = self._all_kept
            self._kept_poses.update({name: (previous_tick, pose) for name, pose in poses.items()})
        kept = self._changed_objects(tick, objects)
        self._all_kept = (tick, objects) if type(objects) is PosesAtTick and len(kept) == len(objects) else None
        return kept

    def _have_all_moved(self, objects: PosesAtTick) -> bool:
        """Return whether all poses of the previous sample were kept and all objects have moved since then."""
        if self._all_kept is None:
            return False
        previous, predicted = self._all_kept[1], objects.predicted
        return previous.predicted is predicted and previous.row == objects.row - 1 and predicted.all_moved[objects.row]

    def _changed_objects(self, tick: int, objects: Mapping[str, Pose3]) -> dict[str, Pose3]:
        """Return the poses to keep.

        These are the poses that have changed since they were last kept, and the poses that were last kept at least one
        period of STANDSTILL_RATE_HZ ago.
        """
        kept = dict[str, Pose3]()
        is_stationary = objects is self._previous_poses
        if is_stationary and tick < self._standstill_due_tick:
            return kept
        for name, pose in objects.items():
            previous = self._kept_poses.get(name)
            if previous is None or previous[1] != pose or tick - previous[0] >= self._standstill_period:
                self._kept_poses[name] = (tick, pose)
                kept[name] = pose
        self._previous_poses = objects
        self._standstill_due_tick = 0
        if is_stationary:
            oldest = min([self._kept_poses[name][0] for name in objects], default=tick)
            self._standstill_due_tick = oldest + self._standstill_period
        return kept


class Throttle:
    """Limits a topic to `rate` messages per second of simulated time."""

    def __init__(self, tick_rate: int, rate: int) -> None:
        self._period = max(1, tick_rate // rate)
        self._next_tick: int | None = None

    def passes(self, tick: int) -> bool:
        """Return whether a message may be written at this tick. If so, a new period begins."""
        if self._next_tick is not None and tick < self._next_tick:
            return False
        self._next_tick = tick + self._period
        return True
