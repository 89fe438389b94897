"""Combines a drive, the given parts, and the estimated parts into the contents of the scenario file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from simscen.core.geometry import Pose2, wrap
from simscen.core.records.verdict import unique_name
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, RecordedGoal
from simscen.reconstruction.objects.found_object import FoundObject
from simscen.reconstruction.reasons import FoundFault, Reason
from simscen.reconstruction.scenario.criteria import ProposedCriterion, propose_criteria
from simscen.reconstruction.scenario.incidents import Incident

INVALID_GOAL_CODES = frozenset({"GOAL_OCCUPIED", "GOAL_OUTSIDE_MAP"})
"""Error codes of goals that no robot can reach. The scenario expects these errors."""
TIMEOUT_CODE = "NAVIGATE_TIMEOUT"
"""Error code of a goal that was not reached within its timeout."""
MAX_REFUSAL_S = 1.0
"""Maximum time until a robot refuses a goal that cannot be reached."""
MIN_WAIT_S = 0.3
"""Minimum time between a result and the next goal that counts as a wait at the goal."""
MIN_TIMEOUT_S, TIMEOUT_FACTOR = 30.0, 2.0
"""Minimum timeout of a goal, and ratio of the timeout to the recorded time."""
UNFINISHED_TIMEOUT_FACTOR = 1.1
"""Ratio of the timeout to the recorded time, for a goal that was active when the log ended."""
MIN_TIME_LIMIT_S, MAX_TIME_LIMIT_S = 60.0, 8000.0
"""Minimum and maximum time limit of the scenario."""
RADIUS_STEP_M = 0.05
"""Step to whose multiples the distance at which goals count as passed is rounded up."""
MAX_DEFAULT_ERROR_M, MAX_DEFAULT_ERROR_RAD = 0.15, math.radians(6)
"""Maximum error of the first belief with which the scenario has the default initial estimate."""
UNKNOWN_START_STD_M = 1.5
"""Standard deviation of the first belief above which the localizer did not know where the robot started."""


@dataclass(frozen=True)
class EstimatedParts:
    """Parts of the scenario that the estimators found in a drive.

    Attributes:
        incidents: What went wrong in the drive.
        objects: Objects that are not on the map.
        faults: Faults of sensors, actuators, and localizer.
        kidnaps: Time in s, new pose in the map frame, and reason of each kidnapping.
        unknowns: Phrases that complete the sentence "The log does not show …".
    """

    incidents: Sequence[Incident]
    objects: Sequence[FoundObject] = ()
    faults: Sequence[FoundFault] = ()
    kidnaps: Sequence[tuple[float, Pose2, Reason]] = ()
    unknowns: Sequence[str] = ()


@dataclass(frozen=True)
class GivenParts:
    """Parts of the scenario that are not estimated.

    Attributes:
        world: Value of the key `world`.
        map: Value of the key `map`; "" if the scenario does not have this key.
        robot: Name of a shipped robot, or path of a robot file.
        seed: Seed of the run.
        stack: Value of the key `stack`; empty if the scenario does not have this key.
        reasons: Reasons for the values, by key.
        unknowns: Phrases that complete the sentence "The log does not show …".
    """

    world: str | Mapping[str, Any]
    map: str
    robot: str
    seed: int
    stack: Mapping[str, Any] = field(default_factory=dict)
    reasons: Mapping[str, Reason] = field(default_factory=dict)
    unknowns: Sequence[str] = ()


@dataclass(frozen=True)
class ScenarioGoal:
    """Goal of the reconstructed scenario.

    Attributes:
        name: Unique name.
        pose: Pose in the map frame.
        timeout: Timeout in s.
        reason: Reason for the goal.
        expect: Name of the error code with which the goal must fail; "" if the robot must reach the goal.
        wait: Time in s that the robot waits at the goal.
    """

    name: str
    pose: Pose2
    timeout: float
    reason: Reason
    expect: str = ""
    wait: float = 0.0


@dataclass(frozen=True)
class ScenarioContents:
    """Contents of a scenario file.

    Attributes:
        name: Name of the scenario.
        source: Name of the log.
        summary: Sentences about the drive.
        given: Parts that are not estimated.
        estimated: Parts that the estimators found.
        start: True initial pose of the robot in the map frame.
        estimate: Initial estimate with standard deviations of x, y (m), and yaw (rad); "unknown" for global
            localization; None for the default.
        passing_radius: Distance in m at which goals count as passed; None if the robot stops at each goal.
        goals: Goals in the order in which they are sent.
        stops_at_failure: Whether the run ends at the first failed goal.
        time_limit: Time limit of the scenario in s.
        criteria: Proposed criteria.
        reasons: Reasons for world, map, robot, start, estimate, stack, and navigation, by key.
        unknowns: Phrases of all parts that complete the sentence "The log does not show …".
    """

    name: str
    source: str
    summary: Sequence[str]
    given: GivenParts
    estimated: EstimatedParts
    start: Pose2
    estimate: tuple[Pose2, tuple[float, float, float]] | str | None
    passing_radius: float | None
    goals: Sequence[ScenarioGoal]
    stops_at_failure: bool
    time_limit: float
    criteria: Sequence[ProposedCriterion]
    reasons: Mapping[str, Reason]
    unknowns: Sequence[str]


def scenario_contents(
    drive: RecordedDrive, given: GivenParts, estimated: EstimatedParts, name: str, source: str
) -> ScenarioContents:
    """Return the contents of the scenario file of the scenario `name`. `source` is the name of the log."""
    start = Pose2(*drive.poses.poses_at(np.zeros(1))[0].tolist())
    estimate, estimate_reason = _initial_estimate(drive, start, given.map == "none")
    goals = [*_scenario_goals(drive)]
    is_refusal_expected = bool(goals) and all(goal.expect for goal in goals)
    reasons = dict(given.reasons)
    reasons["start"] = Reason(f"first pose of the drive, from {drive.pose_source}", 0.0)
    if estimate_reason is not None:
        reasons["estimate"] = estimate_reason
    passing = passing_radius(drive)
    if passing is not None:
        text = f"goals were passed without a stop, at a distance of at most {passing:g} m"
        reasons["navigation"] = Reason(text, None, None, "medium")
    max_timeout = max((goal.timeout for goal in goals), default=MIN_TIMEOUT_S)
    time_limit = min(MAX_TIME_LIMIT_S, max(MIN_TIME_LIMIT_S, 2 * drive.duration, drive.duration + max_timeout))
    return ScenarioContents(
        name=name,
        source=source,
        summary=[*_summary(drive, estimated)],
        given=given,
        estimated=estimated,
        start=start,
        estimate=estimate,
        passing_radius=passing,
        goals=goals,
        stops_at_failure=not any(goal.status == "failed" for goal in drive.goals[:-1]),
        time_limit=time_limit,
        criteria=[*propose_criteria(drive, estimated.incidents, estimated.faults, is_refusal_expected)],
        reasons=reasons,
        unknowns=[*given.unknowns, *estimated.unknowns, *drive.notes],
    )


def passing_radius(drive: RecordedDrive) -> float | None:
    """Return the distance in m at which goals counted as passed; None if the robot passed no goal without a stop.

    It is the largest distance between a goal and the estimated pose when the goal was passed, rounded up.
    """
    distances = [
        _estimated_pose(drive, goal.end_time).distance(goal.pose)
        for goal in drive.goals
        if goal.status == "passed" and goal.end_time is not None
    ]
    return round(math.ceil(max(distances) / RADIUS_STEP_M) * RADIUS_STEP_M, 2) if distances else None


def _estimated_pose(drive: RecordedDrive, time: float) -> Pose2:
    """Return the robot's estimate of its pose at a time in s; the best known pose if the log has no estimates."""
    times = np.array([time])
    if not len(drive.corrections) or not len(drive.odometry):
        return Pose2(*drive.poses.poses_at(times)[0].tolist())
    correction, odometry = drive.corrections.values_at(times)[0], drive.odometry.poses_at(times)[0]
    return Pose2(*correction.tolist()).compose(Pose2(*odometry.tolist()))


def _initial_estimate(
    drive: RecordedDrive, start: Pose2, is_mapless: bool
) -> tuple[tuple[Pose2, tuple[float, float, float]] | str | None, Reason | None]:
    """Return the initial estimate of the localizer and its reason; (None, None) for the default estimate.

    The estimate is "unknown", or a pose with the standard deviations of x, y (m), and yaw (rad).
    """
    if is_mapless or not len(drive.belief):
        return None, None
    values = drive.belief.values[0]
    pose = Pose2(*values[:3].tolist())
    std = tuple(math.sqrt(max(value, 1e-6)) for value in values[[3, 6, 8]].tolist())
    time = float(drive.belief.times[0])
    if max(std[:2]) > UNKNOWN_START_STD_M:
        text = f"the first belief has a standard deviation of {max(std[:2]):.1f} m, so the start was unknown"
        return "unknown", Reason(text, time, None, "medium")
    if pose.distance(start) <= MAX_DEFAULT_ERROR_M and abs(wrap(pose.yaw - start.yaw)) <= MAX_DEFAULT_ERROR_RAD:
        return None, None
    text = f"the first belief was {pose.distance(start):.2f} m from the start"
    return (pose, (max(std[0], 0.1), max(std[1], 0.1), max(std[2], 0.05))), Reason(text, time, None, "medium")


def _scenario_goals(drive: RecordedDrive) -> Iterator[ScenarioGoal]:
    """Yield the goals of the scenario with unique names."""
    used_names: set[str] = set()
    for index, goal in enumerate(drive.goals):
        name = unique_name(goal.name.replace("#", " loop "), used_names, "-")
        next_goal = drive.goals[index + 1] if index + 1 < len(drive.goals) else None
        was_refused = goal.end_time is not None and goal.end_time - goal.sent_time < MAX_REFUSAL_S
        expect = goal.error if was_refused and goal.error in INVALID_GOAL_CODES else ""
        yield ScenarioGoal(
            name, goal.pose, _timeout(goal, drive.duration), _goal_reason(goal), expect, _wait(goal, next_goal)
        )


def _goal_reason(goal: RecordedGoal) -> Reason:
    """Return the source and the result of a goal as a reason."""
    error = f" ({goal.error})" if goal.error else ""
    result = "its result is unknown" if goal.status == "unknown" else f"{goal.status}{error}"
    confidence = "high" if goal.source.startswith("/") else "medium"
    return Reason(f"{goal.source}; {result}", goal.sent_time, goal.end_time, confidence)


def _timeout(goal: RecordedGoal, duration: float) -> float:
    """Return the timeout of a goal in s. `duration` is the duration of the drive in s."""
    if goal.end_time is not None and goal.error == TIMEOUT_CODE:
        return goal.end_time - goal.sent_time
    if goal.end_time is None:
        return max(MIN_TIMEOUT_S, math.ceil(UNFINISHED_TIMEOUT_FACTOR * (duration - goal.sent_time)))
    return max(MIN_TIMEOUT_S, math.ceil(TIMEOUT_FACTOR * (goal.end_time - goal.sent_time)))


def _wait(goal: RecordedGoal, next_goal: RecordedGoal | None) -> float:
    """Return the time in s that the robot waits at a goal before the next goal."""
    if next_goal is None or goal.end_time is None or goal.status not in ("reached", "unknown"):
        return 0.0
    wait = next_goal.sent_time - goal.end_time
    return round(wait, 1) if wait >= MIN_WAIT_S else 0.0


def _summary(drive: RecordedDrive, estimated: EstimatedParts) -> Iterator[str]:
    """Yield sentences about the drive and its incidents."""
    yield f"Reconstructed from a recorded drive of {drive.duration:.1f} s."
    for incident in estimated.incidents:
        x, y = incident.position
        yield f"At {incident.time:.1f} s, at ({x:.2f}, {y:.2f}): {incident.kind}, {incident.detail}."
    if not estimated.incidents:
        yield "The drive had no incident."
