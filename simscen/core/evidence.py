"""What a log must hold for a criterion to be decided. One that simscen wrote holds everything."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum


class Evidence(str, Enum):
    """A kind of knowledge about a run, in words that end the sentence "the log does not say …"."""

    TRUTH = "where the robot truly was"
    VELOCITY = "how fast the robot truly went"
    CLEARANCE = "how near obstacles truly were"
    CONTACTS = "what the robot touched"
    BELIEF = "where the robot believed to be"
    COVARIANCE = "how sure it was of that"
    SCANS = "when scans came"
    COMMANDS = "which velocities were commanded"
    PLANS = "which plans were made"
    NAVIGATION = "what became of goals"
    ERROR_CODES = "the navigation's error codes"
    PLANNING = "why plans were made"
    RECOVERIES = "which recoveries there were"
    OBJECTS = "where things that move were"
    DISTURBANCES = "when faults and events happened"
    ALIGNMENT = "how the truth lies on the map"
    FOOTPRINT = "how much ground the robot covers"


@dataclass(frozen=True)
class Coverage:
    """What a log lacks: `missing` altogether, or for a part of the time (`partial`); each with the reason."""

    missing: Mapping[Evidence, str] = field(default_factory=dict)
    partial: Mapping[Evidence, str] = field(default_factory=dict)


WHOLE = Coverage()
"""That of a log that simscen wrote."""
