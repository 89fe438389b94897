"""A person who walks by themselves, as an action puts one into the world; and what a person has done."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from simscen.core.geometry import Pose2

Behavior = Literal["regular", "impassive", "surprised", "scared", "curious", "threatening"]
"""How somebody takes the robot (HuNavSim's names)."""
Unseen = Literal["robots", "people", "objects"]
Repeat = Literal["once", "loop", "back_and_forth"]

BODY_HEIGHT = 1.7
"""m; a body is an upright cylinder."""


@dataclass(frozen=True)
class WalkingPedestrian:
    """Somebody called `name` who starts at rest at `pose` and walks to `goals` (x, y) in turn, in meters.

    `speed` in m/s is the one they like best, `radius` and `height` those of their body in meters. Those of one `group`
    keep together. `blind_to` is what they take no notice of. `reacts_within` meters and `reacts_for` seconds say when
    a behavior other than regular and impassive begins and how long it lasts.
    """

    name: str
    pose: Pose2
    goals: tuple[tuple[float, float], ...] = ()
    repeat: Repeat = "once"
    speed: float = 1.3
    radius: float = 0.25
    height: float = BODY_HEIGHT
    behavior: Behavior = "regular"
    group: str | None = None
    blind_to: frozenset[Unseen] = frozenset()
    reacts_within: float = 0.0
    reacts_for: float = 0.0


@dataclass(frozen=True)
class PedestrianAction:
    """Something a person did: `what` is reached, reacted or calmed.

    `about` is the number of the goal (from 1), or the robot.
    """

    name: str
    what: Literal["reached", "reacted", "calmed"]
    about: str
