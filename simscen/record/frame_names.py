"""The names of the coordinate frames (ROS REP 105)."""

MAP, ODOM, BASE, TRUTH = "map", "odom", "base_link", "base_link_truth"
_OBJECT = "object/"


class RobotFrames:
    """The frames of a robot. Each of several has its name in front of its own, so that all are in one tree.

    `map` and the frames of moving things are of all.
    """

    def __init__(self, robot: str = "") -> None:
        # What begins with object/ is a moving thing's.
        self._front = f"{robot}{'_' if f'{robot}/' == _OBJECT else ''}/" if robot else ""
        self.odom, self.base, self.truth = self.of(ODOM), self.of(BASE), self.of(TRUTH)

    def of(self, frame: str) -> str:
        """What the log calls a frame of the robot's stack."""
        return frame if frame == MAP else f"{self._front}{frame}"

    def of_sensor(self, name: str) -> str:
        """What the log calls the frame of a sensor."""
        return self.of(sensor_frame(name))

    def own(self, frame: str) -> str:
        """What the robot's stack calls a frame of the log; older logs call it so, too."""
        return frame.removeprefix(self._front)


def sensor_frame(name: str) -> str:
    """The frame of a sensor: its own name, unless that would close a loop in the tree."""
    return f"{name}_link" if name in (MAP, ODOM, BASE, TRUTH) else name


def object_frame(name: str) -> str:
    """The frame of a moving thing, apart from the robot's frames whatever its name."""
    return f"{_OBJECT}{name}"


def object_in_frame(frame: str) -> str | None:
    """The moving thing whose frame this is; None for other frames."""
    return frame[len(_OBJECT) :] if frame.startswith(_OBJECT) else None
