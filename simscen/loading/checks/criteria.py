"""Checks for criteria that no run can pass, and for criteria that hardly any run can fail."""

from collections.abc import Callable, Iterator
from typing import Any

from simscen.loading.checks.events import why_no_recovery
from simscen.loading.checks.registry import MEANING, CheckProblem
from simscen.loading.known_names import goal_names
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Keys
from simscen.model.navigation import expected_failure_name

GOAL_CRITERIA = frozenset({"goals_reached", "time_to_goal", "no_false_success", "stuck", "result", "error_code"})
"""Criteria that have nothing to judge if the robot gets no goal."""
NO_ERROR = 0
"""Nav2's error code for success."""
LOOSE_SPEED_RATIO = 1.2
"""Bounds on the speed above this multiple of the top speed are loose."""
LOOSE_PATH_RATIO = 10.0
"""Bounds on the path length above this multiple of the shortest path are loose."""
LOOSE_COLLISION_COUNT = 1000
"""Bounds on the number of collisions of at least this number are loose."""

LooseBounds = Iterator[tuple[str, str]]
"""Key and reason of each loose bound of a criterion. A bound is loose if hardly any run can violate it."""


@MEANING.check("SC036")
def undecidable_criteria(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find criteria that need more time than the time limit of the run."""
    limit = loaded.spec.time_limit
    for index, entry in enumerate(loaded.spec.pass_):
        horizon = getattr(entry.chosen, "horizon", 0.0)
        if horizon > limit:
            message = f"`{entry.kind}` can never hold: it needs {horizon:g} s, but the time limit is {limit:g} s"
            yield CheckProblem(("pass", index, entry.kind), message, at_key=True)


@MEANING.check("SC036")
def runs_without_motion(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find time limits before the second sample of the ground truth, with which no motion can be judged."""
    period = 1.0 / loaded.spec.physics.truth_rate
    if loaded.spec.time_limit < period:
        message = f"nothing can be judged: the second sample of the ground truth is at t = {period:g} s"
        yield CheckProblem(("time_limit",), message)


@MEANING.check("SC051")
def impossible_criteria(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find criteria that no run can pass."""
    for index, entry in enumerate(loaded.spec.pass_):
        check = _WHY_IMPOSSIBLE.get(entry.kind)
        reason = _why_no_goals(loaded, entry.kind, entry.chosen) or (check(loaded, entry.chosen) if check else None)
        if reason:
            yield CheckProblem(("pass", index, entry.kind), f"{entry.kind} can never hold: {reason}", at_key=True)


def _why_no_goals(loaded: LoadedScenario, kind: str, criterion: Any) -> str | None:
    """Return a reason if a criterion of this kind needs a goal and the robot gets none; else None."""
    needs_goal = kind in GOAL_CRITERIA or (kind == "path_length" and criterion.max_ratio is not None)
    return "the robot gets no goal" if needs_goal and not goal_names(loaded) else None


def _why_impossible_result(loaded: LoadedScenario, result: Any) -> str | None:
    """Return the reason why no run can have the required result; None if a run can."""
    cancels = any(action.may_do("cancel_goal") for step in loaded.spec.steps for action in step.actions)
    if result.status == "CANCELED" and not cancels:
        return "no event cancels a goal"
    if result.status == "SUCCEEDED" and result.error_code not in (None, NO_ERROR):
        return f"a result that SUCCEEDED has no error code such as {result.error_code.name}"
    if result.status == "FAILED" and result.error_code == NO_ERROR:
        return "a result that FAILED has an error code other than NONE"
    return None


def _why_no_recoveries(loaded: LoadedScenario, recoveries: Any) -> str | None:
    """Return the reason why no run can have the required recoveries; None if a run can."""
    return why_no_recovery(loaded, recoveries.name) if recoveries.min else None


_WHY_IMPOSSIBLE = {"result": _why_impossible_result, "recoveries": _why_no_recoveries}
"""Functions that return the reason why a criterion is impossible, or None, by kind of the criterion."""


@MEANING.check("SC051")
def contradicting_criteria(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find pairs of criteria that require different results of the navigation."""
    failing = any(expected_failure_name(goal.expect) for goal in loaded.spec.goals)
    required_results: dict[str, tuple[str, Keys]] = {}
    for index, entry in enumerate(loaded.spec.pass_):
        if entry.severity != "fail":
            continue
        every_goal = entry.kind == "goals_reached" and getattr(entry.chosen, "goals", None) is None and not failing
        status = "SUCCEEDED" if every_goal else str(getattr(entry.chosen, "status", "")) if entry.result else ""
        if not status:
            continue
        keys: Keys = ("pass", index, entry.kind)
        before = next((other for key, other in required_results.items() if key != status), None)
        if before:
            first = loaded.key_position_of(*before[1])
            message = f"{entry.kind} contradicts {before[0]} at {first.line}:{first.col}: no run can pass both"
            yield CheckProblem(keys, message, at_key=True)
        required_results.setdefault(status, (entry.kind, keys))


@MEANING.check("SC051")
def goals_after_a_failure(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find goals that are never sent, because the run stops at the expected failure of the goal before."""
    spec = loaded.spec
    new_goals = any(action.may_do("new_goal") for step in spec.steps for action in step.actions)
    if spec.on_goal_failure == "continue" or new_goals:
        return
    for index, goal in enumerate(spec.goals):
        if expected_failure_name(goal.expect) and (spec.navigation.loops > 1 or index + 1 < len(spec.goals)):
            following = spec.goal_names[(index + 1) % len(spec.goals)]
            message = f"the robot never gets goal `{following}`: it stops after this goal, which is expected to fail"
            yield CheckProblem(("goals", index, "expect"), message, "set `on_goal_failure: continue`")
            return


@MEANING.check("SC052", severity="warning")
def loose_bounds(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find bounds that hardly any run can violate, because of physics or the time limit."""
    for index, entry in enumerate(loaded.spec.pass_):
        check = _LOOSE_BOUNDS.get(entry.kind)
        for key, reason in check(loaded, entry.chosen) if check else ():
            yield CheckProblem(("pass", index, entry.kind, key), f"{entry.kind} can hardly fail: {reason}")


def _loose_speed(loaded: LoadedScenario, speed: Any) -> LooseBounds:
    robot = loaded.robot.spec
    if robot is None:
        return
    if speed.max is not None and speed.max > LOOSE_SPEED_RATIO * robot.top_speed:
        yield "max", f"the robot's top speed is {robot.top_speed:g} m/s"
    if speed.max_turn_rate is not None and speed.max_turn_rate > LOOSE_SPEED_RATIO * robot.limits.angular:
        yield "max_turn_rate", f"the robot's maximum turn rate is {robot.limits.angular:g} rad/s"


def _loose_path_length(loaded: LoadedScenario, length: Any) -> LooseBounds:
    robot, limit = loaded.robot.spec, loaded.spec.time_limit
    if length.max_ratio is not None and length.max_ratio > LOOSE_PATH_RATIO:
        yield "max_ratio", f"that is {length.max_ratio:g} times the shortest path"
    if robot is not None and length.max is not None and length.max > robot.top_speed * limit:
        yield "max", f"at its top speed the robot drives {robot.top_speed * limit:g} m within the time limit"


def _loose_collisions(_: LoadedScenario, collisions: Any) -> LooseBounds:
    if collisions.max is not None and collisions.max >= LOOSE_COLLISION_COUNT:
        yield "max", f"no run has {collisions.max} collisions"


def _loose_goals_reached(loaded: LoadedScenario, reached: Any) -> LooseBounds:
    yield from _beyond_limit(loaded, reached, "within")
    timeouts = [goal.timeout for goal in loaded.spec.goals]
    own = [timeout for timeout in timeouts if timeout is not None]
    if reached.within is not None and own and len(own) == len(timeouts) and reached.within > max(own):
        yield "within", f"the goals' own timeouts end after at most {max(own):g} s"


def _beyond_limit(loaded: LoadedScenario, criterion: Any, key: str) -> LooseBounds:
    """Yield the bound `key` of a criterion, a time, if it is not below the time limit of the run."""
    value, limit = getattr(criterion, key), loaded.spec.time_limit
    if value is not None and value >= limit:
        yield key, f"the time limit ends the run after {limit:g} s"


def _time_bound(key: str) -> Callable[[LoadedScenario, Any], LooseBounds]:
    """Return a function that yields the bound `key` of a criterion, a time, if it is loose."""
    return lambda loaded, criterion: _beyond_limit(loaded, criterion, key)


_LOOSE_BOUNDS: dict[str, Callable[[LoadedScenario, Any], LooseBounds]] = {
    "speed": _loose_speed,
    "path_length": _loose_path_length,
    "collisions": _loose_collisions,
    "goals_reached": _loose_goals_reached,
    "time_to_goal": _time_bound("max"),
    "stuck": _time_bound("max"),
    "stopped_within": _time_bound("time"),
    "relocalized_within": _time_bound("time"),
}
"""Functions that yield the loose bounds of a criterion, by kind of the criterion."""


@MEANING.check("SC052", severity="warning")
def only_warnings(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find scenarios in which all criteria have `severity: warn`, so that no run can fail."""
    if all(entry.severity == "warn" for entry in loaded.spec.pass_):
        yield CheckProblem(("pass",), "no criterion can fail the run: all are `severity: warn`", at_key=True)
