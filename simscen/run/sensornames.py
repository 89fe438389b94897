"""What senses on a robot, by name: as logs and external stacks are told."""

from simscen.core.geometry import Pose3
from simscen.core.messages.sensor_data import Odometry
from simscen.model.robot import Mount, RobotSpec
from simscen.run.prepare import Prepared
from simscen.stack.localizers.ground_truth import TRUTH


def sensor_kinds(prepared: Prepared) -> dict[str, str]:
    """The kinds of readings of all that senses, by name, in the order in which they are read."""
    told = {TRUTH: Odometry.__name__} if prepared.stack.told_truth else {}
    return {name: sensor.says for name, sensor in prepared.robot.sensors.items()} | told


def sensor_frames(robot: RobotSpec) -> dict[str, Pose3]:
    """Where sensors that look somewhere sit on the base."""
    mounts = {name: getattr(sensor.chosen, "mount", None) for name, sensor in robot.sensors.items()}
    return {name: mount.pose for name, mount in mounts.items() if isinstance(mount, Mount)}
