"""Objects that the scans show and the map does not: what they are like, and where they are over time."""

from __future__ import annotations

from dataclasses import dataclass, field

from simscen.reconstruction.evidence import Evidence

Keyframe = tuple[float, float, float, float]
"""Time in s since the start of the drive, x, y, yaw."""


@dataclass(frozen=True)
class FoundObject:
    """An object that is not on the map.

    Attributes:
        name: Name in the scenario.
        size: Length and width in m of a box, or the radius of a cylinder alone.
        keyframes: Poses over time; a single one for an object that stands.
        appears: Time in s at which it appears; None if it is there from the start.
        disappears: Time in s at which it disappears; None if it stays.
        evidence: Why it is there.
    """

    name: str
    size: tuple[float, ...]
    keyframes: tuple[Keyframe, ...]
    appears: float | None = None
    disappears: float | None = None
    evidence: Evidence = field(default_factory=lambda: Evidence(""))

    @property
    def is_moving(self) -> bool:
        """Whether it moves."""
        return len(self.keyframes) > 1

    @property
    def is_cylinder(self) -> bool:
        """Whether it is an upright cylinder; otherwise it is a box."""
        return len(self.size) == 1
