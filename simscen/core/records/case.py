"""Parts of a scenario that criteria need (Case), and a simulated and judged run (Run)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.geometry import Polygon, Pose2
from simscen.core.messages.goals import Goal
from simscen.core.records.disturbances import Disturbance
from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Status, Verdict

Point = tuple[float, float]


@dataclass(frozen=True)
class Passage:
    """Narrow passage on the shortest path to a goal: a gap between two static solids.

    `goal` is the name of the goal. `ends` are the points (x, y) on the two sides of the gap, in m in the world frame.
    `between` contains the names of the solids; "" for a solid without a name.
    """

    goal: str
    ends: tuple[Point, Point]
    between: tuple[str, str] = ("", "")

    @property
    def width(self) -> float:
        """Width of the gap in m."""
        return math.dist(*self.ends)

    @property
    def middle(self) -> Point:
        """Center of the gap."""
        (ax, ay), (bx, by) = self.ends
        return (ax + bx) / 2, (ay + by) / 2

    @property
    def description(self) -> str:
        """Description such as "the passage of 0.90 m between `wall 3` and `wall 4` at (9.00, 5.75)"."""
        first, second = self.between
        between = f" between `{first}` and `{second}`" if first and second and first != second else ""
        return f"the passage of {self.width:.2f} m{between} at ({self.middle[0]:.2f}, {self.middle[1]:.2f})"


SINGLE_ROBOT_NAME = ""
"""Name of the robot in a scenario with a single robot."""
CLEARANCE_RANGE_M = 2.0
"""Default of `Case.clearance_range`."""


@dataclass(frozen=True)
class Case:
    """Parts of a scenario that criteria need to judge runs. The log of each run contains these parts, too.

    Attributes:
        start: Start pose of the robot.
        goals: Goals of the scenario, in order.
        shortest: Length in m of the shortest path to each goal, by goal name; inf if there is no path. The path starts
            at the previous goal that is not in `expected`, or at the start pose. It is planned for a disc with the
            radius `inscribed_radius` in the static world.
        regions: Regions of the world by name.
        footprint: Footprint of the robot in the base frame; empty if unknown.
        inscribed_radius: Radius in m of the largest circle around the base that fits in the footprint.
        time_limit: Maximum simulated time of the run in s.
        clearance_range: Measuring range of the clearance in m. Larger clearances are recorded as this value.
        disturbances: The events of the scenario, each followed by the steps of its sequence (`then`), and the faults.
        sent: Goals that events can send during the run.
        passages: Narrow passages on the shortest paths, in driving direction.
        masks: Filter masks that criteria refer to, by the path in the scenario.
        expected: Expected failure of goals, by goal name: "failed" for any failure, or the name of an error code.
        labels: Names of all events, faults, and marks, for criteria of a criteria file; None for criteria of the
            scenario, whose names were checked before the run. Not written to logs.
        objects: Names of all objects, other robots, and pedestrians; None as for `labels`. Not written to logs.
    """

    start: Pose2
    goals: tuple[Goal, ...]
    shortest: Mapping[str, float] = field(default_factory=dict)
    regions: Mapping[str, Polygon] = field(default_factory=dict)
    footprint: Polygon = ()
    inscribed_radius: float = 0.0
    time_limit: float = 0.0
    clearance_range: float = CLEARANCE_RANGE_M
    disturbances: tuple[Disturbance, ...] = ()
    sent: tuple[Goal, ...] = ()
    passages: tuple[Passage, ...] = ()
    masks: Mapping[str, MaskBlocks] = field(default_factory=dict)
    expected: Mapping[str, str] = field(default_factory=dict)
    labels: frozenset[str] | None = None
    objects: frozenset[str] | None = None

    @property
    def every_goal(self) -> tuple[Goal, ...]:
        """Goals of the scenario, followed by the goals that events can send."""
        return *self.goals, *self.sent


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """A simulated and judged run.

    Attributes:
        result: Outcome, verdicts, and metrics.
        trace: Recorded states, readings, decisions, and events.
        case: Parts of the scenario that the criteria used.
        log: MCAP file of the run; None if none was requested.
        stack: Facts that an external stack sent, such as its version; empty for the reference stack.
        robots: One run for each robot by name, if there are several robots; `trace`, `case`, and `stack` of the whole
            run then belong to the first robot.
    """

    result: RunResult
    trace: Trace
    case: Case
    log: Path | None = None
    stack: Mapping[str, Any] = field(default_factory=dict)
    robots: Mapping[str, "Run"] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return the scenario, the seed, the outcome, and the reasons of a failure."""
        unsatisfied = [(v.id, v.tightest) for v in self.result.verdicts if v.status is not Status.PASS]
        reasons = [
            f"{name} {finding.measured} ({finding.limit})" for name, finding in unsatisfied if finding is not None
        ]
        summary = f"<Run of {self.result.key.test}, seed {self.result.key.seed}: {self.result.outcome.value}"
        return f"{summary}{''.join(f'; {reason}' for reason in reasons)}>"

    @property
    def passed(self) -> bool:
        """Whether the outcome is "passed". Criteria with `severity: warn` may have failed."""
        return self.result.outcome is Outcome.PASSED

    @property
    def as_expected(self) -> bool:
        """Whether the run passed, or failed as its scenario expects."""
        return self.result.outcome.is_good

    def verdict(self, name: str) -> Verdict:
        """Return the verdict with the id `name`, e.g. "path_length". Raises KeyError if no verdict has this id."""
        verdicts = {verdict.id: verdict for verdict in self.result.verdicts}
        if name not in verdicts:
            raise KeyError(f"no criterion has the id {name!r}; there are: {', '.join(verdicts)}")
        return verdicts[name]
