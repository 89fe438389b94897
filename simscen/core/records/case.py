"""The parts of a scenario that judging needs besides the trace, and a run with everything known about it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Goal
from simscen.core.records.events import Disturbance
from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Status, Verdict

Point = tuple[float, float]


@dataclass(frozen=True)
class Passage:
    """A line across the shortest way to a goal, from one fixed solid to another, in the world frame.

    Who takes that way has to cross the line, so what stands on it is in the way. `between` are the names of the two
    solids; "" for one without a name.
    """

    goal: str
    ends: tuple[Point, Point]
    between: tuple[str, str] = ("", "")

    @property
    def width(self) -> float:
        """Meters from solid to solid."""
        return math.dist(*self.ends)

    @property
    def middle(self) -> Point:
        """The point halfway."""
        (ax, ay), (bx, by) = self.ends
        return (ax + bx) / 2, (ay + by) / 2

    @property
    def told(self) -> str:
        """In words: "the passage of 0.90 m between `wall 3` and `wall 4` at (9.00, 5.75)"."""
        one, other = self.between
        between = f" between `{one}` and `{other}`" if one and other and one != other else ""
        return f"the passage of {self.width:.2f} m{between} at ({self.middle[0]:.2f}, {self.middle[1]:.2f})"


CLEARANCE_RANGE = 2.0
"""Meters around the robot's hull in which clearance is always measured."""


@dataclass(frozen=True)
class Case:
    """The parts of a scenario that judging needs; travels in the log, so that a log alone can be judged.

    `shortest` maps a goal's name to the length in meters of the shortest way that a disc of the robot's inscribed
    radius has from the goal before it (the start for the first) through the static world; inf when there is none.
    `sent` are the goals that events may send on the way.
    `expected` maps the name of a goal at which the robot is to fail to how: "failed", or the name of an error code.
    `clearance_range` is how far around the hull clearance was searched, in meters: a clearance that is not below it was
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
    masks: Mapping[str, MaskBlocks] = field(default_factory=dict)
    expected: Mapping[str, str] = field(default_factory=dict)

    @property
    def every_goal(self) -> tuple[Goal, ...]:
        """The goals in order, then those that events may send."""
        return *self.goals, *self.sent


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """A run: its `result` (outcome, verdicts, metrics), the `trace` it was judged from, the `case` it was judged by.

    `log` is the MCAP file that holds all of it; None when none was asked for. `stack` is what an external stack said of
    itself; empty for one in the engine. `robots` is what came of each of several robots by name, as if it had been the
    only one, e.g. `run.robots["left"].trace`; `trace`, `case` and `stack` are then those of the first.
    """

    result: RunResult
    trace: Trace
    case: Case
    log: Path | None = None
    stack: Mapping[str, Any] = field(default_factory=dict)
    robots: Mapping[str, "Run"] = field(default_factory=dict)

    def __repr__(self) -> str:
        """What it is and why it did not pass, so that `assert run.passed` says it."""
        broken = [(v.id, v.tightest) for v in self.result.verdicts if v.status is not Status.PASS]
        why = [f"{name} {finding.measured} ({finding.limit})" for name, finding in broken if finding is not None]
        told = f"<Run of {self.result.key.test}, seed {self.result.key.seed}: {self.result.outcome.value}"
        return f"{told}{''.join(f'; {each}' for each in why)}>"

    @property
    def passed(self) -> bool:
        """Whether everything held; a run that could not be completed never passed."""
        return self.result.outcome is Outcome.PASSED

    @property
    def as_expected(self) -> bool:
        """Whether it passed, or failed as its scenario says it does."""
        return self.result.outcome.good

    def verdict(self, name: str) -> Verdict:
        """The verdict of the criterion with this id, e.g. `run.verdict("path_length").status`. Raises KeyError."""
        found = {verdict.id: verdict for verdict in self.result.verdicts}
        if name not in found:
            raise KeyError(f"no criterion is called {name!r}; there are: {', '.join(found)}")
        return found[name]
