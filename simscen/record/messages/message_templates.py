"""Templates of ROS 2 messages of fixed size. Encoders of other messages are in encode.py.

`Template.packer()` returns a function that packs a message. It takes the values of the fields in the order in which the
docstring of the template names them, and returns the bytes of the message.

The field `stamp` is seconds and nanoseconds, `pose` is x, y, z and a quaternion x, y, z, w, and `twist` is vx, vy, wz.
Unknown covariances are zeros.
"""

from collections.abc import Sequence

from simscen.record.messages.template import Template

_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)
_TWIST = "2d24xd"
"""Format of six numbers, as in `struct`: vx, vy, wz, and zeros for the other three."""
_COVARIANCE = "2d24x3d24xd144x2d24xd"
"""Format of a 6 x 6 covariance: the nine numbers for x, y, yaw, and zeros for the others."""
_TWIST_VARIANCES = "d48xd216xd"
"""Format of a 6 x 6 covariance: the variances of vx, vy, wz on the diagonal, and zeros for the others."""


def clock() -> Template:
    """Return the template of rosgraph_msgs/msg/Clock, with the field stamp."""
    return Template().slot("iI", "*stamp")


def float64() -> Template:
    """Return the template of std_msgs/msg/Float64, with the field value."""
    return Template().slot("d", "value")


def twist() -> Template:
    """Return the template of geometry_msgs/msg/Twist, with the field twist."""
    return Template().slot(_TWIST, "*twist")


def odometry(frame: str, child: str) -> Template:
    """Return the template of nav_msgs/msg/Odometry without covariances, with the fields stamp, pose, twist.

    `pose` is the pose of the frame `child` in `frame`. `twist` is in the frame `child`.
    """
    return (
        _stamped(frame)
        .string(child)
        .slot("7d", "*pose")
        .put("36d", *[0.0] * 36)
        .slot(_TWIST, "*twist")
        .put("36d", *[0.0] * 36)
    )


def odometry_with_covariance(frame: str, child: str) -> Template:
    """Return the template of nav_msgs/msg/Odometry, with the fields stamp, pose, covariance, twist, variances.

    `covariance` is 3 x 3 for x, y, yaw, row by row. `variances` are the variances of vx, vy, wz.
    """
    return (
        _stamped(frame)
        .string(child)
        .slot("7d", "*pose")
        .slot(_COVARIANCE, "*covariance")
        .slot(_TWIST, "*twist")
        .slot(_TWIST_VARIANCES, "*variances")
    )


def imu(frame: str) -> Template:
    """Return the template of sensor_msgs/msg/Imu.

    Its fields are stamp, angular_velocity (x, y, z), angular_velocity_variance, linear_acceleration (x, y, z), and
    linear_acceleration_variance. The variance is the same for all axes. The message has no orientation.
    """
    message = _stamped(frame).put("4d", *_NO_ROTATION).put("9d", -1.0, *[0.0] * 8)
    for vector in ("angular_velocity", "linear_acceleration"):
        message.slot("3d", f"*{vector}")
        for _ in range(2):
            message.slot("d24x", f"{vector}_variance")
        message.slot("d", f"{vector}_variance")
    return message


def pose_with_covariance(frame: str) -> Template:
    """Return the template of geometry_msgs/msg/PoseWithCovarianceStamped, with the fields stamp, pose, covariance.

    `covariance` is 3 x 3 for x, y, yaw, row by row.
    """
    return _stamped(frame).slot("7d", "*pose").slot(_COVARIANCE, "*covariance")


def pose_stamped(frame: str) -> Template:
    """Return the template of geometry_msgs/msg/PoseStamped, with the fields stamp, pose."""
    return _stamped(frame).slot("7d", "*pose")


def transforms(links: Sequence[tuple[str, str, str]], serialized_count: int = 0, serialized_bytes: int = 0) -> Template:
    """Return the template of tf2_msgs/msg/TFMessage, with the fields stamp, one pose for each link, and `serialized`.

    A link is (frame, child frame, name of the field for the pose). All transforms have the same stamp. `serialized` are
    the `serialized_bytes` bytes of `serialized_count` further transforms, from a TransformBatchPacker. The field does
    not exist if `serialized_count` is 0.
    """
    message = Template().put("I", len(links) + serialized_count)
    for frame, child, pose in links:
        message.slot("iI", "*stamp")
        message.string(frame)
        message.string(child)
        message.slot("7d", f"*{pose}")
    if serialized_count:
        message.slot(f"{serialized_bytes}s", "serialized")
    return message


def _stamped(frame: str) -> Template:
    return Template().slot("iI", "*stamp").string(frame)
