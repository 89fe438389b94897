"""Detects the collisions of a robot, and creates an event at the start and the end of each collision."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from simscen.core.geometry import Vector
from simscen.core.records.events import Event, EventKind

END_DELAY_S = 0.1
"""Time without contact after which a collision has ended."""
MIN_CAUSING_SPEED_M_S = 0.02
"""Smallest speed at which a robot counts as the cause of a collision.

If the object cannot move, the speed of the robot in any direction counts, otherwise only its speed towards the object.
"""


@dataclass(frozen=True)
class ContactPoint:
    """Contact of a robot with one object during one tick.

    name, other_id:  name and body id of the object
    point, normal:   point and unit normal towards the robot in the world frame
    impulse:         contact impulse in N s
    """

    name: str
    other_id: int
    point: Vector
    normal: Vector
    impulse: float


class BodyMotion(NamedTuple):
    """Position of a body's frame, and its linear (m/s) and angular (rad/s) velocity along the world axes."""

    origin: Vector
    linear: Vector
    angular: Vector


@dataclass
class _OngoingCollision:
    """Ticks of the first and the newest contact, and the sum of the impulses in N s."""

    first_tick: int
    last_tick: int
    impulse: float


class CollisionTracker:
    """Combines the contacts of consecutive ticks into collisions with a start and an end."""

    def __init__(self, tick_rate: int) -> None:
        self._end_delay = round(END_DELAY_S * tick_rate)
        self._ongoing: dict[str, _OngoingCollision] = {}
        self._events: list[Event] = []

    def has_contact_at(self, tick: int) -> bool:
        """Return whether the robot touched anything at `tick`, which must not be before the last update."""
        return bool(self._ongoing) and any(collision.last_tick == tick for collision in self._ongoing.values())

    @property
    def is_colliding(self) -> bool:
        """Whether any collision has started and not ended."""
        return bool(self._ongoing)

    def update(
        self, tick: int, contacts: list[ContactPoint], robot: BodyMotion, others: Mapping[int, BodyMotion]
    ) -> None:
        """Process the contacts at `tick`.

        `robot` and `others` are the motions of the robot and of all other bodies that can move (by body id), before the
        step that ended at `tick`.
        """
        for contact in contacts:
            collision = self._ongoing.get(contact.name)
            if collision is None:
                self._ongoing[contact.name] = _OngoingCollision(tick, tick, contact.impulse)
                self._events.append(_started_event(tick, contact, robot, others.get(contact.other_id)))
            else:
                collision.last_tick, collision.impulse = tick, collision.impulse + contact.impulse
        self._end_collisions(
            tick, sorted(name for name, each in self._ongoing.items() if tick - each.last_tick >= self._end_delay)
        )

    def end_all(self, tick: int) -> None:
        """End all collisions, because the robot is placed at `tick`."""
        self._end_collisions(tick, sorted(self._ongoing))

    def _end_collisions(self, tick: int, names: list[str]) -> None:
        for name in names:
            ended = self._ongoing.pop(name)
            data = {"impulse": ended.impulse, "ticks": ended.last_tick - ended.first_tick + 1}
            self._events.append(Event(tick, EventKind.COLLISION_ENDED, name, data))

    def take_events(self) -> tuple[Event, ...]:
        """Return the events since the last call."""
        if not self._events:
            return ()
        events, self._events = tuple(self._events), []
        return events


def _started_event(tick: int, contact: ContactPoint, robot: BodyMotion, other: BodyMotion | None) -> Event:
    """Return the event for the start of a collision. `other` is None for an object that cannot move."""
    robot_velocity = _velocity_at(robot, contact.point)
    other_velocity = _velocity_at(other, contact.point) if other else (0.0, 0.0, 0.0)
    approach = -_dot(robot_velocity, contact.normal)
    is_grazing = other is None and math.hypot(*robot_velocity) >= MIN_CAUSING_SPEED_M_S
    return Event(
        tick,
        EventKind.COLLISION_STARTED,
        contact.name,
        {
            "x": contact.point[0],
            "y": contact.point[1],
            "impulse": contact.impulse,
            "speed": max(0.0, approach + _dot(other_velocity, contact.normal)),
            "robot_speed": max(0.0, approach),
            "robot_caused": approach >= MIN_CAUSING_SPEED_M_S or is_grazing,
            "robot_part": "hull",
        },
    )


def _velocity_at(motion: BodyMotion, point: Vector) -> Vector:
    """Return the velocity in m/s of the part of a body that is at `point`."""
    (vx, vy, vz), (wx, wy, wz) = motion.linear, motion.angular
    x, y, z = (point[i] - motion.origin[i] for i in range(3))
    return vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x


def _dot(velocity: Vector, normal: Vector) -> float:
    return sum(v * n for v, n in zip(velocity, normal, strict=True))
