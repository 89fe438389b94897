"""Decode and validate the ROS messages in an answer of an external stack.

Values on a topic NAME/exact have full precision, and replace the values on the topic NAME. Decoders raise
ProtocolViolation for invalid values, such as nan.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from simscen.core.clock import NS_PER_SECOND, Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, Path
from simscen.core.messages.sensor_data import Odometry
from simscen.core.records.trace import CostGrid, LogLine
from simscen.peer import wire
from simscen.peer.cdr import Reader
from simscen.peer.messages import read
from simscen.record import frame_names, topics
from simscen.record.messages import decode
from simscen.record.messages.decode import MessageReader, StampedPose, decode_checked
from simscen.record.trace_builder import to_planar
from simscen.run.external.protocol import EXACT_SUFFIX, FLOAT64_ARRAY, POSE2D, STACK_TOPICS, ProtocolViolation

if TYPE_CHECKING:
    from simscen.peer.wire import Messages

MAX_PARTICLES = 1_000_000
"""Largest number of particles in a message."""
_PLANAR_INDICES = (0, 1, 5, 6, 7, 11, 30, 31, 35)
"""Indices of the covariance over x, y, yaw in the 36 numbers of a ROS covariance."""
_PLANAR_DIAGONAL = (0, 7, 35)
"""Indices of the variances of x, y, yaw in the 36 numbers of a ROS covariance."""
ODOMETRY_COLUMNS = 19
"""Numbers of an exact odometry reading: tick, pose (3), twist (3), twist variances (3), pose covariance (9)."""
_TYPES = {topic.name: topic.type for topic in STACK_TOPICS}

MessagesByTopic = dict[str, list[bytes]]
"""Encoded messages of an answer by topic name, in the order of arrival."""
T = TypeVar("T")

MAX_QUATERNION_COMPONENT = 1.01
"""Largest accepted component of a unit quaternion, with a margin for rounding."""


@dataclass(frozen=True, eq=False)
class Answer:
    """A decoded answer. An attribute, except `map_from_odom`, is None or empty if the answer does not contain it.

    A `plan` without poses means that the stack follows no plan. `map_from_odom` is the last transform that the stack
    has sent, in this or an earlier answer; None if there is none. `lines` are messages on /rosout.
    """

    command: Twist | None = None
    plan: Path | None = None
    local_plan: Path | None = None
    belief: Belief | None = None
    map_from_odom: Pose2 | None = None
    events: tuple[dict[str, Any], ...] = ()
    lines: tuple[LogLine, ...] = ()
    costmaps: tuple[CostGrid, ...] = ()
    odometry: tuple[Odometry, ...] = ()


def group_by_topic(messages: Messages) -> MessagesByTopic:
    """Return the messages of an answer by topic. Raises ProtocolViolation for an unknown topic number."""
    found: MessagesByTopic = {}
    for number, data in messages:
        if not 1 <= number <= len(STACK_TOPICS):
            raise ProtocolViolation(f"a message on topic number {number}, which does not exist")
        found.setdefault(STACK_TOPICS[number - 1].name, []).append(data)
    return found


def decode_answer(
    messages: MessagesByTopic, tick: int, clock: Clock, map_from_odom: Pose2 | None, odometry_pose: Pose2 | None
) -> Answer:
    """Decode the answer at `tick`. Raises ProtocolViolation for an invalid message.

    `map_from_odom` is the last transform in earlier answers; None if there is none. `odometry_pose` is the last pose of
    the wheel odometry. If the stack has not sent any transform, `map_from_odom` of the belief is computed from the
    estimated pose and from the pose of the stack's filtered odometry, or else from `odometry_pose`.
    """
    if len(messages.get(topics.COMMAND.name, ())) > 1:
        raise ProtocolViolation("two commands in one answer")
    map_from_odom = _map_from_odom(messages) or map_from_odom
    odometry = tuple(_filtered_odometry(messages, clock, tick))
    if odometry:
        odometry_pose = odometry[-1].pose
    return Answer(
        command=_decode_last(messages, topics.COMMAND.name, _decode_command),
        plan=_path(messages, topics.PLAN.name, tick, clock),
        local_plan=_path(messages, topics.LOCAL_PLAN.name, tick, clock),
        belief=_belief(messages, map_from_odom, odometry_pose),
        map_from_odom=map_from_odom,
        events=tuple(_decode_all(messages, topics.EVENTS.name, _decode_event)),
        lines=tuple(_decode_all(messages, topics.ROSOUT.name, lambda data: decode.log_line(MessageReader(data)))),
        costmaps=tuple(_costmaps(messages)),
        odometry=odometry,
    )


def _belief(messages: MessagesByTopic, map_from_odom: Pose2 | None, odometry_pose: Pose2 | None) -> Belief | None:
    """Return the pose estimate in an answer, or None. `decode_answer` describes the parameters."""
    name = topics.BELIEF.name
    message = _decode_last(messages, name, _decode_belief_pose)
    if message is None:
        return None
    exact = _decode_last(messages, name + EXACT_SUFFIX, _decode_pose2d)
    pose = exact if exact is not None else _to_pose2(message)
    if map_from_odom is None:
        map_from_odom = pose if odometry_pose is None else pose.compose(odometry_pose.inverse())
    covariance = _decode_message(name, _decode_covariance, messages[name][-1])
    particles = _decode_last(messages, topics.PARTICLES.name, _decode_particles)
    exact_particles = _decode_last(messages, topics.PARTICLES.name + EXACT_SUFFIX, lambda data: _decode_table(data, 4))
    cloud = exact_particles if exact_particles is not None else particles
    if cloud is not None and not np.isfinite(cloud).all():
        raise ProtocolViolation(f"a particle on {topics.PARTICLES.name} that is not finite")
    return Belief(pose, covariance, map_from_odom, cloud if cloud is not None else np.empty((0, 4)))


def _map_from_odom(messages: MessagesByTopic) -> Pose2 | None:
    """Return the last transform of an answer from the odom frame to the map frame, or None."""
    exact = _decode_last(messages, topics.TF.name + EXACT_SUFFIX, _decode_pose2d)
    if exact is not None:
        return exact
    links = [
        link
        for part in _decode_all(messages, topics.TF.name, partial(decode_checked, decode.transforms))
        for link in part
    ]
    matching = [link for link in links if (link.frame, link.child) == (frame_names.MAP, frame_names.ODOM)]
    return _to_pose2(matching[-1]) if matching else None


def _filtered_odometry(messages: MessagesByTopic, clock: Clock, now: int) -> Iterator[Odometry]:
    """Yield the readings of the stack's odometry filter. `now` is the current tick."""
    name = topics.FILTERED_ODOMETRY.name
    exact = _decode_last(messages, name + EXACT_SUFFIX, lambda data: _decode_table(data, ODOMETRY_COLUMNS))
    if exact is not None:
        rows = [(row[0], row[1:4], row[4:7], row[7:10], row[10:]) for row in exact.tolist()]
    else:
        readings = _decode_all(messages, name, partial(read, topics.ODOMETRY_TYPE))
        if wrong_frame := next(
            (message.frame for message in readings if message.frame not in (frame_names.ODOM, "")), None
        ):
            raise ProtocolViolation(f"odometry on {name} in the frame `{wrong_frame}` instead of `{frame_names.ODOM}`")
        rows = [
            (
                clock.tick_at(message.stamp[0] * NS_PER_SECOND + message.stamp[1]),
                list(message.pose),
                [message.vx, message.vy, message.wz],
                [message.twist_covariance[i] for i in _PLANAR_DIAGONAL],
                [message.pose_covariance[i] for i in _PLANAR_INDICES],
            )
            for message in readings
        ]
    for tick, pose, twist, variances, covariance in rows:
        if not all(map(math.isfinite, (*pose, *twist, *variances, *covariance))):
            raise ProtocolViolation(f"odometry on {name} that is not finite")
        if not 0 <= tick <= now:
            raise ProtocolViolation(f"odometry on {name} with a stamp that is not between the start and now")
        vx, vy, wz = variances
        a, b, c, d, e, f, g, h, i = covariance
        yield Odometry("", int(tick), Pose2(*pose), Twist(*twist), (vx, vy, wz), (a, b, c, d, e, f, g, h, i))


def _path(messages: MessagesByTopic, name: str, tick: int, clock: Clock) -> Path | None:
    """Return the last path on the topic `name`, or None.

    The tick of the path is the stamp of the message, or `tick` if the stamp is 0, is in the future, or is missing
    because the path is only on the exact topic.
    """
    message = _decode_last(messages, name, partial(decode_checked, decode.path))
    exact = _decode_last(messages, name + EXACT_SUFFIX, lambda data: _decode_table(data, 3))
    if message is None and exact is None:
        return None
    stamp_tick = 0 if message is None else clock.tick_at(message.stamp)
    points = exact if exact is not None else to_planar(message.poses) if message is not None else np.empty((0, 3))
    if not np.isfinite(points).all():
        raise ProtocolViolation(f"a path on {name} that is not finite")
    return Path(points, stamp_tick if 0 < stamp_tick <= tick else tick)


def _costmaps(messages: MessagesByTopic) -> Iterator[CostGrid]:
    """Yield the last global costmap and the last local costmap, if there are any."""
    for name, topic in (("global", topics.GLOBAL_COSTMAP.name), ("local", topics.LOCAL_COSTMAP.name)):
        if messages.get(topic):
            yield _decode_message(topic, partial(_decode_costmap, name), messages[topic][-1])


def _decode_costmap(name: str, data: bytes) -> CostGrid:
    message = read(topics.MAP.type, data)
    if message.frame not in (frame_names.MAP, frame_names.ODOM):
        raise ProtocolViolation(
            f"a {name} costmap in the frame `{message.frame}` instead of `{frame_names.MAP}` or `{frame_names.ODOM}`"
        )
    if not (0.0 < message.resolution < math.inf and all(map(math.isfinite, message.origin))):
        raise ProtocolViolation(
            f"a {name} costmap with a resolution of {message.resolution:g} m and the origin {tuple(message.origin)}"
        )
    if message.width * message.height != len(message.data):
        raise ProtocolViolation(
            f"a {name} costmap of {message.width} x {message.height} cells with {len(message.data)} values"
        )
    cells = np.array(message.data, dtype=np.int8).reshape(message.height, message.width)
    return CostGrid(name, message.frame, OccupancyGrid(cells, message.resolution, Pose2(*message.origin)))


def _decode_command(data: bytes) -> Twist:
    command = Twist(*decode_checked(decode.twist, data).values)
    if not all(map(math.isfinite, command)):
        raise ProtocolViolation(f"a command that is not finite: {', '.join(f'{value:g}' for value in command)}")
    return command


def _decode_belief_pose(data: bytes) -> StampedPose:
    """Return the estimated pose in a PoseWithCovarianceStamped, which must be in the map frame."""
    message = decode_checked(decode.pose_with_covariance_stamped, data)
    if message.frame not in (frame_names.MAP, ""):
        raise ProtocolViolation(
            f"a pose on {topics.BELIEF.name} in the frame `{message.frame}` instead of `{frame_names.MAP}`"
        )
    if not all(map(math.isfinite, (*message.pose, *message.covariance))):
        raise ProtocolViolation(f"a pose on {topics.BELIEF.name} that is not finite")
    return message


def _decode_covariance(data: bytes) -> Array:
    """Return the covariance (3, 3) of x, y, and yaw in a PoseWithCovarianceStamped."""
    reader = Reader(data)
    reader.take("iI")
    reader.string()
    reader.take("7d")
    numbers = reader.take("36d")
    return np.array([numbers[i] for i in _PLANAR_INDICES], dtype=np.float64).reshape(3, 3)


def _to_pose2(message: StampedPose) -> Pose2:
    x, y, yaw = to_planar(np.array([message.pose]))[0].tolist()
    return Pose2(x, y, yaw)


def _decode_particles(data: bytes) -> Array:
    """Return the particles (n, 4) in a ParticleCloud: x, y, yaw, and weight."""
    reader = Reader(data)
    reader.take("iI")
    reader.string()
    (count,) = reader.take("I")
    if count > MAX_PARTICLES:
        raise ProtocolViolation(f"{count} particles on {topics.PARTICLES.name}, more than {MAX_PARTICLES}")
    poses = np.array([reader.take("8d") for _ in range(count)], dtype=np.float64).reshape(-1, 8)
    if not (np.abs(poses[:, 3:7]) <= MAX_QUATERNION_COMPONENT).all():
        raise ProtocolViolation(
            f"a particle on {topics.PARTICLES.name} with an orientation that is not a unit quaternion"
        )
    return np.column_stack((to_planar(poses[:, :7]), poses[:, 7]))


def _decode_pose2d(data: bytes) -> Pose2:
    pose = Pose2(*read(POSE2D, data))
    if not all(map(math.isfinite, pose)):
        raise ProtocolViolation("a pose that is not finite")
    return pose


def _decode_table(data: bytes, width: int) -> Array:
    """Return the numbers in a Float64MultiArray as rows (n, width)."""
    numbers = np.array(read(FLOAT64_ARRAY, data), dtype=np.float64)
    if len(numbers) % width:
        raise ProtocolViolation(f"{len(numbers)} numbers, which cannot be split into rows of {width}")
    return numbers.reshape(-1, width)


def _decode_event(data: bytes) -> dict[str, Any]:
    return wire.from_json(MessageReader(data).string().encode())


def _decode_last(messages: MessagesByTopic, name: str, decoder: Callable[[bytes], T]) -> T | None:
    """Decode the last message on the topic `name`; return None if there is none. Raises ProtocolViolation."""
    found = messages.get(name)
    return _decode_message(name, decoder, found[-1]) if found else None


def _decode_all(messages: MessagesByTopic, name: str, decoder: Callable[[bytes], T]) -> list[T]:
    return [_decode_message(name, decoder, data) for data in messages.get(name, ())]


def _decode_message(name: str, decoder: Callable[[bytes], T], data: bytes) -> T:
    try:
        return decoder(data)
    except ProtocolViolation:
        raise
    except (ValueError, struct.error, RecursionError) as error:
        raise ProtocolViolation(f"a message on {name} that is not a valid {_TYPES[name]}: {error}") from error
