"""A robot above its ground."""

import math
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.model.robot import Omnidirectional, RobotSpec
from simscen.sim.body.outline import radius_and_height
from simscen.sim.body.robot_body import RobotBody

GROUND_CLEARANCE = 0.005
"""m that a hull must be above the ground."""


def check_ground_clearance(spec: RobotSpec, file: Path | None) -> None:
    """Raises InvalidInput for a robot on wheels with a part of its `body` on the ground."""
    on_wheels = not isinstance(spec.drive, Omnidirectional)
    if on_wheels and any(part.z < GROUND_CLEARANCE for part in spec.body or ()):
        message = f"a part of the body of {spec.name!r} reaches the ground: it would drag instead of roll"
        hint = f"give each part a `z` of at least {GROUND_CLEARANCE:g} m"
        raise InvalidInput([Problem(str(file or spec.name), 0, 0, "SC401", message, hint)])


# A larger robot would make maps and footprints of the stack exhaust memory and time.
FARTHEST = 10.0
"""m from the base, across and in height; the largest vehicles in ports are 15 m long."""


def check_robot_size(body: RobotBody, file: Path | None) -> None:
    """Raises InvalidInput for a robot that extends farther than FARTHEST from its base frame."""
    across, up = radius_and_height(body.solid)
    wheels = max((math.hypot(wheel.x, wheel.y) + wheel.radius for wheel in body.wheels), default=0.0)
    farthest = max(across, up, wheels, body.circumscribed_radius)
    if farthest > FARTHEST:
        message = f"robot {body.name!r} reaches {farthest:.4g} m from its base, more than {FARTHEST:g} m"
        hint = "are lengths in millimeters? they are in meters here"
        raise InvalidInput([Problem(str(file or body.name), 0, 0, "SC402", message, hint)])
