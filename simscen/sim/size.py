"""How large a robot may be: beyond that, maps, footprints and ways of the stack take all memory and time there is."""

import math
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.sim.outline import reach
from simscen.sim.robot_body import RobotBody

FARTHEST = 10.0
"""m from the base, across and in height; the largest vehicles in ports are 15 m long."""


def refuse_giants(body: RobotBody, file: Path | None) -> None:
    """Raises InvalidInput for a robot that extends farther than FARTHEST from its base frame."""
    across, up = reach(body.solid)
    wheels = max((math.hypot(wheel.x, wheel.y) + wheel.radius for wheel in body.wheels), default=0.0)
    farthest = max(across, up, wheels, body.circumscribed_radius)
    if farthest > FARTHEST:
        message = f"robot {body.name!r} reaches {farthest:.4g} m from its base, more than {FARTHEST:g} m"
        hint = "are lengths in millimeters? they are in meters here"
        raise InvalidInput([Problem(str(file or body.name), 0, 0, "SC402", message, hint)])
