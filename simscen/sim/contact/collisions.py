"""What the robot touches: one event when it begins, one when it is over."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import pybullet

from simscen.core.records.events import Event, EventKind

PATIENCE = 0.1
"""Seconds without contact after which a collision is over; a bouncing robot collides once."""
STANDING = 0.02
"""A robot that moves more slowly than this, in m/s, towards what it touches did not cause the contact.

What never moves is touched because the robot moves, in whatever direction: it may graze.
"""

NOBODY = -1
"""No number of the engine's."""

Vector = tuple[float, float, float]
Owner = Callable[[Vector], str]
Stands = Callable[[int, int, float], bool]


@dataclass(frozen=True)
class ContactPoint:
    """The robot and something press on each other: `place` and unit `normal` towards the robot in the world frame.

    `other` is the engine's number of what is touched, `impulse` in N s during one tick; `fixed`: it never moves.
    """

    name: str
    other: int
    place: Vector
    normal: Vector
    impulse: float
    fixed: bool


class BaseMotion(NamedTuple):
    """How a robot moves: its base frame's origin, m/s and rad/s along the world's axes."""

    origin: Vector
    linear: Vector
    angular: Vector


class PreStepMotion(NamedTuple):
    """How everything moved before a step: the robot, other bodies (m/s) and all robots, by the engine's numbers."""

    robot: BaseMotion
    others: Mapping[int, Vector]
    robots: Mapping[int, BaseMotion]


@dataclass
class _Ongoing:
    started: int
    last: int
    impulse: float


class CollisionTracker:
    """Turns touches of single ticks into collisions with a beginning and an end."""

    def __init__(self, tick_rate: int) -> None:
        self._patience = round(PATIENCE * tick_rate)
        self._ongoing: dict[str, _Ongoing] = {}
        self._events: list[Event] = []

    def touched(self, tick: int) -> bool:
        """Whether anything was touched at `tick`, which is now."""
        return bool(self._ongoing) and any(seen.last == tick for seen in self._ongoing.values())

    @property
    def touching(self) -> bool:
        """Whether anything was touched lately."""
        return bool(self._ongoing)

    def note(self, tick: int, contact_points: list[ContactPoint], before: PreStepMotion) -> None:
        """Take what was touched at `tick`, and how everything moved just before."""
        for touch in contact_points:
            known = self._ongoing.get(touch.name)
            if known is None:
                self._ongoing[touch.name] = _Ongoing(tick, tick, touch.impulse)
                self._events.append(_started(tick, touch, before))
            else:
                known.last, known.impulse = tick, known.impulse + touch.impulse
        self._end(tick)

    def _end(self, tick: int) -> None:
        for name in sorted(name for name, seen in self._ongoing.items() if tick - seen.last >= self._patience):
            seen = self._ongoing.pop(name)
            data = {"impulse": seen.impulse, "ticks": seen.last - seen.started + 1}
            self._events.append(Event(tick, EventKind.COLLISION_ENDED, name, data))

    def take(self) -> tuple[Event, ...]:
        """The events since last asked."""
        if not self._events:
            return ()
        events, self._events = tuple(self._events), []
        return events


def _nowhere(*_: float) -> bool:
    return False


def contact_points(
    client: int, robot: int, names: Mapping[int, str | None], owner: Owner, seconds: float, stands: Stands = _nowhere
) -> list[ContactPoint]:
    """What presses on the robot now; `names` of bodies, None where the owner of the triangle is to be found.

    `stands` says of a body, a link of the robot and the z of the unit normal towards it whether that link stands on it.
    """
    found: dict[str, ContactPoint] = {}
    for point in pybullet.getContactPoints(robot, physicsClientId=client):
        other, place, normal, distance, force = point[2], point[6], point[7], point[8], point[9]
        if other not in names or (force <= 0 and distance > 0) or stands(other, point[3], normal[2]):
            continue
        name = names[other] or owner(place)
        known = found.get(name)
        impulse = force * seconds + (known.impulse if known else 0.0)
        found[name] = ContactPoint(name, other, place, normal, impulse, names[other] is None)
    return [found[name] for name in sorted(found)]


def enclosed_contact(name: str, place: Vector) -> ContactPoint:
    """The robot is wholly inside something, at a place of it: a touch from below, so that nobody moved towards it."""
    return ContactPoint(name, NOBODY, place, (0.0, 0.0, 1.0), 0.0, fixed=True)


def _started(tick: int, touch: ContactPoint, before: PreStepMotion) -> Event:
    robot = _at(before.robot, touch.place)
    if touch.other in before.robots:
        others = _at(before.robots[touch.other], touch.place)
    else:
        others = before.others.get(touch.other, (0.0, 0.0, 0.0))
    approach = -_along(robot, touch.normal)
    return Event(
        tick,
        EventKind.COLLISION_STARTED,
        touch.name,
        {
            "x": touch.place[0],
            "y": touch.place[1],
            "impulse": touch.impulse,
            "speed": max(0.0, approach + _along(others, touch.normal)),
            "robot_speed": max(0.0, approach),
            "robot_caused": approach >= STANDING or (touch.fixed and math.hypot(*robot) >= STANDING),
            "robot_part": "hull",
        },
    )


def _at(motion: BaseMotion, place: Vector) -> Vector:
    """The robot's velocity at a place."""
    (vx, vy, vz), (wx, wy, wz) = motion.linear, motion.angular
    x, y, z = (place[i] - motion.origin[i] for i in range(3))
    return vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x


def _along(velocity: Vector, normal: Vector) -> float:
    return sum(v * n for v, n in zip(velocity, normal, strict=True))
