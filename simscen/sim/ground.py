"""A robot above its ground."""

from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.model.robot import Omnidirectional, RobotSpec

GROUND_CLEARANCE = 0.005
"""m that a hull must be above the ground."""


def refuse_dragging(spec: RobotSpec, file: Path | None) -> None:
    """Raises InvalidInput for a robot on wheels with a part of its `body` on the ground."""
    on_wheels = not isinstance(spec.drive, Omnidirectional)
    if on_wheels and any(part.z < GROUND_CLEARANCE for part in spec.body or ()):
        message = f"a part of the body of {spec.name!r} reaches the ground: it would drag instead of roll"
        hint = f"give each part a `z` of at least {GROUND_CLEARANCE:g} m"
        raise InvalidInput([Problem(str(file or spec.name), 0, 0, "SC401", message, hint)])
