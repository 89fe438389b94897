"""The names of the coordinate frames (ROS REP 105)."""

MAP, ODOM, BASE, TRUTH = "map", "odom", "base_link", "base_link_truth"
_OBJECT = "object/"


def of_sensor(name: str) -> str:
    """The frame of a sensor: its own name, unless that would close a loop in the tree."""
    return f"{name}_link" if name in (MAP, ODOM, BASE, TRUTH) else name


def of_object(name: str) -> str:
    """The frame of a moving thing, apart from the robot's frames whatever its name."""
    return f"{_OBJECT}{name}"


def object_in(frame: str) -> str | None:
    """The moving thing whose frame this is; None for other frames."""
    return frame[len(_OBJECT) :] if frame.startswith(_OBJECT) else None
