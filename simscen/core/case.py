"""What a criterion may know of a scenario besides the trace."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from simscen.core.disturbance import Disturbance
from simscen.core.geometry import Pose2
from simscen.core.maskcells import MaskCells
from simscen.core.navigation import Goal
from simscen.core.passage import Passage
from simscen.core.world import Polygon

CLEARANCE_RANGE = 2.0
"""Metres around the robot's hull in which clearance is always measured."""


@dataclass(frozen=True)
class Case:
    """The parts of a scenario that judging needs; travels in the log, so that a log alone can be judged.

    `shortest` maps a goal's name to the length in metres of the shortest way that a disc of the robot's inscribed
    radius has from the goal before it (the start for the first) through the static world; inf when there is none.
    `sent` are the goals that events may send on the way.
    `expected` maps the name of a goal at which the robot is to fail to how: "failed", or the name of an error code.
    `clearance_range` is how far around the hull clearance was searched, in metres: a clearance that is not below it was
    cut off, and is at least that.
    `passages` are what these ways lead through, goal by goal, each in the direction of its way.
    `disturbances` are what has to happen: the scenario's events, then its faults.
    `masks` are the filter masks that criteria name, by their files as written.
    """

    start: Pose2
    goals: tuple[Goal, ...]
    shortest: Mapping[str, float] = field(default_factory=dict)
    regions: Mapping[str, Polygon] = field(default_factory=dict)
    footprint: Polygon = ()
    inscribed_radius: float = 0.0
    time_limit: float = 0.0
    clearance_range: float = CLEARANCE_RANGE
    disturbances: tuple[Disturbance, ...] = ()
    sent: tuple[Goal, ...] = ()
    passages: tuple[Passage, ...] = ()
    masks: Mapping[str, MaskCells] = field(default_factory=dict)
    expected: Mapping[str, str] = field(default_factory=dict)

    @property
    def every_goal(self) -> tuple[Goal, ...]:
        """The goals in order, then those that events may send."""
        return *self.goals, *self.sent
