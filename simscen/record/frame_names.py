"""Names of the coordinate frames in a log (ROS REP 105)."""

MAP, ODOM, BASE, TRUTH = "map", "odom", "base_link", "base_link_truth"
"""Frames of the map, the odometry, and the robot's base (REP 105), and the frame at the true pose of the base."""
_OBJECT_PREFIX = "object/"


class RobotFrames:
    """Names of the frames of one robot in the log.

    With several robots, the frames of a robot have its name as a prefix. The frame `map` and the frames of moving
    objects have no prefix.

    Attributes:
        prefix: Prefix of the robot's frames, such as "carrier/"; "" for a single robot.
        odom: Name of the frame ODOM of the robot.
        base: Name of the frame BASE of the robot.
        truth: Name of the frame TRUTH of the robot.
    """

    def __init__(self, robot: str = "") -> None:
        """Return the names for the robot named `robot`; "" for a single robot."""
        # A robot named "object" must not get the prefix of the moving objects.
        self.prefix = f"{robot}{'_' if f'{robot}/' == _OBJECT_PREFIX else ''}/" if robot else ""
        self.odom, self.base, self.truth = self.log_frame(ODOM), self.log_frame(BASE), self.log_frame(TRUTH)

    def log_frame(self, frame: str) -> str:
        """Return the name that a frame of the robot's stack has in the log."""
        return frame if frame == MAP else f"{self.prefix}{frame}"

    def sensor_frame(self, sensor: str) -> str:
        """Return the name that the frame of a sensor has in the log."""
        return self.log_frame(sensor_frame(sensor))

    def stack_frame(self, frame: str) -> str:
        """Return the name that a frame of the log has in the robot's stack: its name without `prefix`."""
        return frame.removeprefix(self.prefix)


def sensor_frame(sensor: str) -> str:
    """Return the name of a sensor's frame in the stack.

    It is the name of the sensor, or `NAME_link` if the sensor has the name of a frame in this module.
    """
    return f"{sensor}_link" if sensor in (MAP, ODOM, BASE, TRUTH) else sensor


def object_frame(name: str) -> str:
    """Return the name that the frame of a moving object has in the log."""
    return f"{_OBJECT_PREFIX}{name}"


def object_of_frame(frame: str) -> str | None:
    """Return the name of the moving object that a frame of the log belongs to; None for other frames."""
    return frame[len(_OBJECT_PREFIX) :] if frame.startswith(_OBJECT_PREFIX) else None
