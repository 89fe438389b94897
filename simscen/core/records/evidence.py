"""What a log must hold for a criterion to be decided, and what a given log lacks of it."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, field, replace
from enum import Enum


class Evidence(str, Enum):
    """A kind of information about a run, in words that end the sentence "the log does not say …"."""

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


POSITION = frozenset({Evidence.TRUTH, Evidence.ALIGNMENT})
"""What is needed to compare the true position with places of the map."""


@dataclass(frozen=True)
class LogCoverage:
    """Evidence that a log lacks, each with the reason: `missing` altogether, or for a part of the time (`partial`).

    `recorded_by_simscen` is False for the log of another recorder, whose signals may be irregular or not finite. In a
    log of simscen's own, that means that the simulation or the log is broken.
    """

    missing: Mapping[Evidence, str] = field(default_factory=dict)
    partial: Mapping[Evidence, str] = field(default_factory=dict)
    recorded_by_simscen: bool = True

    def lacking(self, wanted: Set[Evidence]) -> list[Evidence]:
        """Return the wanted evidence that is missing altogether."""
        return [evidence for evidence in Evidence if evidence in self.missing and evidence in wanted]

    def with_gaps(self, gaps: Mapping[Evidence, str]) -> "LogCoverage":
        """Return the same coverage with more evidence that is there only for a part of the time."""
        return replace(self, partial={**gaps, **self.partial})


COMPLETE_COVERAGE = LogCoverage()
"""Coverage of a run that was just simulated: nothing is missing."""
