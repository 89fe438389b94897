"""Checks for criteria that no run can pass, and for criteria that hardly any run can fail."""

import math
from collections.abc import Iterator
from typing import Any

from simscen.core.messages.navigation import ErrorCode
from simscen.criteria.registry import verdict_names
from simscen.loading.checks.event_feasibility import no_recovery_reason
from simscen.loading.checks.registry import MEANING, CheckProblem
from simscen.loading.known_names import goal_names
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Keys
from simscen.model.navigation import expected_failure_name

GOAL_CRITERIA = frozenset({"goals_reached", "time_to_goal", "no_false_success", "stuck", "result", "error_code"})
"""Kinds of criteria that have nothing to judge if the robot gets no goal."""
LOOSE_SPEED_RATIO = 1.2
"""Bounds on the speed above this multiple of the top speed are loose."""
LOOSE_PATH_RATIO = 10.0
"""Bounds on the path length above this multiple of the shortest path are loose."""
LOOSE_COLLISION_COUNT = 1000
"""A bound on the number of collisions is loose if it is at least this number."""
TIME_BOUNDS = {
    "goals_reached": "within",
    "time_to_goal": "max",
    "stuck": "max",
    "stopped_within": "time",
    "relocalized_within": "time",
}
"""Keys of bounds that are times, by kind of criterion. These bounds are loose if they are not below the time limit."""


@MEANING.check("SC036")
def criteria_beyond_time_limit(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find criteria that need more time than the time limit of the run."""
    limit = loaded.spec.time_limit
    for index, entry in enumerate(loaded.spec.pass_):
        horizon = getattr(entry.chosen, "horizon", 0.0)
        if horizon > limit:
            message = f"`{entry.kind}` can never hold: it needs {horizon:g} s, but the time limit is {limit:g} s"
            yield CheckProblem(("pass", index, entry.kind), message, at_key=True)


@MEANING.check("SC036")
def too_short_time_limits(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find time limits before the second sample of the ground truth. No motion can be judged with a single sample."""
    period = 1.0 / loaded.spec.physics.truth_rate
    if loaded.spec.time_limit < period:
        message = f"nothing can be judged: the second sample of the ground truth is at t = {period:g} s"
        yield CheckProblem(("time_limit",), message)


@MEANING.check("SC051")
def impossible_criteria(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find criteria that no run can pass."""
    for index, entry in enumerate(loaded.spec.pass_):
        if reason := _impossibility_reason(loaded, entry.kind, entry.chosen):
            yield CheckProblem(("pass", index, entry.kind), f"{entry.kind} can never hold: {reason}", at_key=True)


def _impossibility_reason(loaded: LoadedScenario, kind: str, criterion: Any) -> str | None:
    """Return the reason why no run can pass a criterion of this kind; None if a run can."""
    needs_goal = kind in GOAL_CRITERIA or (kind == "path_length" and criterion.max_ratio is not None)
    if needs_goal and not goal_names(loaded):
        return "the robot gets no goal"
    if kind == "recoveries" and criterion.min:
        return no_recovery_reason(loaded, criterion.name)
    if kind != "result":
        return None
    if criterion.status == "CANCELED" and not loaded.may_do("cancel_goal"):
        return "no event cancels a goal"
    if criterion.status == "SUCCEEDED" and criterion.error_code not in (None, ErrorCode.NONE):
        return f"a result that SUCCEEDED has no error code such as {criterion.error_code.name}"
    if criterion.status == "FAILED" and criterion.error_code == ErrorCode.NONE:
        return "a result that FAILED has an error code other than NONE"
    return None


@MEANING.check("SC051")
def contradicting_criteria(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find pairs of criteria that require different results of the navigation."""
    failing = any(expected_failure_name(goal.expect) for goal in loaded.spec.goals)
    required_results: dict[str, tuple[str, Keys]] = {}
    for index, entry in enumerate(loaded.spec.pass_):
        if entry.severity != "fail":
            continue
        if entry.kind == "goals_reached" and entry.chosen.goals is None and not failing:
            status = "SUCCEEDED"
        elif entry.kind == "result":
            status = entry.chosen.status
        else:
            continue
        keys: Keys = ("pass", index, entry.kind)
        contradicted = next((other for key, other in required_results.items() if key != status), None)
        if contradicted:
            first = loaded.key_position_of(*contradicted[1])
            message = f"{entry.kind} contradicts {contradicted[0]} at {first.line}:{first.col}: no run can pass both"
            yield CheckProblem(keys, message, at_key=True)
        required_results.setdefault(status, (entry.kind, keys))


@MEANING.check("SC051")
def goals_after_a_failure(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find goals that are never sent, because the run stops at the expected failure of the goal before."""
    spec = loaded.spec
    if spec.on_goal_failure == "continue" or loaded.may_do("new_goal"):
        return
    for index, goal in enumerate(spec.goals):
        if expected_failure_name(goal.expect) and (spec.navigation.loops > 1 or index + 1 < len(spec.goals)):
            names = spec.goal_names
            following = names[index + 1] if index + 1 < len(names) else f"{names[0]}#2"
            message = f"the robot never gets goal `{following}`: it stops after this goal, which is expected to fail"
            yield CheckProblem(("goals", index, "expect"), message, "set `on_goal_failure: continue`")
            return


@MEANING.check("SC052", severity="warning")
def loose_bounds(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find bounds that hardly any run can violate, because of physics, the time limit, or the timeouts of goals."""
    limit = loaded.spec.time_limit
    for index, entry in enumerate(loaded.spec.pass_):
        found = list(_loose_bounds_of(loaded, entry.kind, entry.chosen))
        time_key = TIME_BOUNDS.get(entry.kind, "")
        time = getattr(entry.chosen, time_key, None)
        if time is not None and time >= limit:
            found.append((time_key, f"the time limit ends the run after {limit:g} s"))
        for key, reason in found:
            yield CheckProblem(("pass", index, entry.kind, key), f"{entry.kind} can hardly fail: {reason}")


def _loose_bounds_of(loaded: LoadedScenario, kind: str, criterion: Any) -> Iterator[tuple[str, str]]:
    """Yield the key and the reason of each loose bound of a criterion. The time limit is not considered."""
    robot = loaded.robot.spec
    match kind:
        case "speed" if robot is not None:
            if criterion.max is not None and criterion.max > LOOSE_SPEED_RATIO * robot.top_speed:
                yield "max", f"the robot's top speed is {robot.top_speed:g} m/s"
            turn_rate = criterion.max_turn_rate
            if turn_rate is not None and turn_rate > LOOSE_SPEED_RATIO * robot.limits.angular:
                yield "max_turn_rate", f"the robot's maximum turn rate is {robot.limits.angular:g} rad/s"
        case "path_length":
            if criterion.max_ratio is not None and criterion.max_ratio > LOOSE_PATH_RATIO:
                yield "max_ratio", f"that is {criterion.max_ratio:g} times the shortest path"
            longest = math.inf if robot is None else robot.top_speed * loaded.spec.time_limit
            if criterion.max is not None and criterion.max > longest:
                yield "max", f"at its top speed the robot drives {longest:g} m within the time limit"
        case "collisions" if criterion.max is not None and criterion.max >= LOOSE_COLLISION_COUNT:
            yield "max", f"no run has {criterion.max} collisions"
        case "goals_reached" if criterion.within is not None:
            timeouts = [goal.timeout for goal in loaded.spec.goals if goal.timeout is not None]
            if timeouts and len(timeouts) == len(loaded.spec.goals) and criterion.within > max(timeouts):
                yield "within", f"the goals' own timeouts end after at most {max(timeouts):g} s"


@MEANING.check("SC052", severity="warning")
def only_warnings(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find scenarios in which all criteria have `severity: warn`, so that no run can fail."""
    if all(entry.severity == "warn" for entry in loaded.spec.pass_):
        yield CheckProblem(("pass",), "no criterion can fail the run: all are `severity: warn`", at_key=True)


@MEANING.check("SC051")
def expected_warnings(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find criteria under `expected.criteria` that cannot fail the run, because they have `severity: warn`."""
    spec = loaded.spec
    severities = dict(zip(verdict_names(spec.pass_), (entry.severity for entry in spec.pass_), strict=True))
    for index, name in enumerate(spec.expected.criteria if spec.expected else ()):
        if severities.get(name) == "warn":
            message = f"`{name}` cannot fail as expected: it has `severity: warn`"
            yield CheckProblem(("expected", "criteria", index), message, "remove `severity: warn`")
