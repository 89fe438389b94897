"""Faults that befall the wheels of one side."""

from simscen.core.geometry.kinematics import Twist
from simscen.faults.base import Instance


def sides(motion: Twist, separation: float) -> tuple[float, float]:
    """How fast the wheels on the left and on the right roll over ground, in m/s."""
    half = separation / 2
    return motion.vx - half * motion.wz, motion.vx + half * motion.wz


def motion_of(left: float, right: float, sideways: float, separation: float) -> Twist:
    """The motion of a base whose sides roll like this."""
    return Twist((left + right) / 2, sideways, (right - left) / separation)


def sideless(instance: Instance, key: str) -> tuple[str, str] | None:
    """Why a key that names a side means nothing on a drive without sides, or on a velocity command."""
    if instance.kind != "Wheels":
        return key, f"`{key}` means nothing there: a command has no sides; say it of `wheels`"
    if instance.spec is not None and not getattr(instance.spec, "wheel_separation", 0.0):
        return key, f"`{key}` means nothing there: this drive has no left and right wheels"
    return None
