"""The names of the coordinate frames (ROS REP 105)."""

MAP, ODOM, BASE, TRUTH = "map", "odom", "base_link", "base_link_truth"


def of_sensor(name: str) -> str:
    """The frame of a sensor: its own name, unless that would close a loop in the tree."""
    return f"{name}_link" if name in (MAP, ODOM, BASE, TRUTH) else name


def of_object(name: str) -> str:
    """The frame of a moving thing, apart from the robot's frames whatever its name."""
    return f"object/{name}"

