"""Names of the coordinate frames in a log (ROS REP 105)."""

MAP, ODOM, BASE, TRUTH = "map", "odom", "base_link", "base_link_truth"
"""Frames of REP 105, and the frame of the true pose of the base."""
_OBJECT_PREFIX = "object/"


class RobotFrames:
    """Names of the frames of one robot in the log.

    With several robots, frames have the robot's name as a prefix, except `map` and the frames of moving objects.
    `prefix` is this prefix, and `odom`, `base`, and `truth` are the names of the frames ODOM, BASE, and TRUTH.
    """

    def __init__(self, robot: str = "") -> None:
        # A robot named "object" must not get the prefix of the moving objects.
        self.prefix = f"{robot}{'_' if f'{robot}/' == _OBJECT_PREFIX else ''}/" if robot else ""
        self.odom, self.base, self.truth = self.log_frame(ODOM), self.log_frame(BASE), self.log_frame(TRUTH)

    def log_frame(self, frame: str) -> str:
        """Return the name in the log of a frame of the robot's stack."""
        return frame if frame == MAP else f"{self.prefix}{frame}"

    def sensor_frame(self, sensor: str) -> str:
        """Return the name in the log of the frame of a sensor."""
        return self.log_frame(sensor_frame(sensor))

    def stack_frame(self, frame: str) -> str:
        """Return the name in the robot's stack of a frame in the log, which is the name without the prefix."""
        return frame.removeprefix(self.prefix)


def sensor_frame(sensor: str) -> str:
    """Return the name of a sensor's frame: the name of the sensor, or `NAME_link` if another frame has this name."""
    return f"{sensor}_link" if sensor in (MAP, ODOM, BASE, TRUTH) else sensor


def object_frame(name: str) -> str:
    """Return the name of the frame of a moving object."""
    return f"{_OBJECT_PREFIX}{name}"


def object_in_frame(frame: str) -> str | None:
    """Return the name of the moving object that the frame belongs to; None for other frames."""
    return frame[len(_OBJECT_PREFIX) :] if frame.startswith(_OBJECT_PREFIX) else None
