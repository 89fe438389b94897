"""Events and faults that can never happen, whatever the robot does: a test of them tests nothing."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any

from simscen.core.goalnames import named
from simscen.core.problems import Problem
from simscen.loading.known_names import own_goal_names, pedestrian_names
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Key
from simscen.model.anystack import ExternalStackSpec
from simscen.model.disturbances import Step
from simscen.model.robot import Holonomic, RobotSpec
from simscen.model.stack import StackSpec
from simscen.triggers.trigger import Test, Trigger

Keys = tuple[Key, ...]
Why = tuple[Keys, str]
"""Where what keeps a trigger from firing stands, and in words that follow "never happens: "."""

LATCHED = frozenset({"time", "travelled", "goal", "waypoint", "replan", "recovery", "collision", "pedestrian", "event"})
"""Conditions that stay true once they are."""
FASTER = 1.1
"""Times its top speed that a robot is at most, by overshoot."""
LOST = 0.5
"""Metres that a stack which is told the truth is never off."""


def never_happens(loaded: LoadedScenario) -> Iterator[Problem]:
    """What can never happen, and what happens less often than it says."""
    run = _Run(loaded, frozenset())
    while (alive := run.possible) != run.alive:
        run = replace(run, alive=alive)
    triggers: list[tuple[Keys, Trigger | None, str, bool]] = [
        *(((*step.keys, "when"), step.when, step.name, step.required) for step in run.steps if run.has_its_turn(step)),
        *((("faults", k, "when"), e.when, e.label, e.required) for k, e in enumerate(loaded.spec.faults)),
    ]
    for keys, trigger, name, required in triggers:
        if trigger is None:
            continue
        if why := run.never(trigger, keys):
            problem = loaded.problem(why[0], "SC050", f"`{name}` can never happen: {why[1]}")
            yield problem if required else replace(problem, severity="warning")
        elif trigger.times > 1 and trigger.edge == "rising" and _latched(trigger):
            message = f"`{name}` happens once, not {trigger.times} times: its condition stays true from then on"
            yield replace(loaded.problem((*keys, "times"), "SC052", message), severity="warning")
    for index, fault in enumerate(loaded.spec.faults):
        if fault.when is not None and fault.when.times > 1 and fault.for_ is None:
            message = f"`{fault.label}` happens once, not {fault.when.times} times: without `for` it lasts to the end"
            keys = ("faults", index, "when", "times")
            yield replace(loaded.problem(keys, "SC052", message, "say how long it lasts: `for`"), severity="warning")
    yield from _over_before(run)


def stopped_pedestrians(loaded: LoadedScenario) -> Iterator[Problem]:
    """People who are stopped for a while: they do not follow a script that could be gone on with."""
    walking = pedestrian_names(loaded)
    for step in loaded.spec.steps:
        for keys, action in step.placed():
            stop: Any = action.chosen
            if action.kind == "stop" and stop.for_ is not None and stop.name in walking:
                message = f"`{step.name}` can never happen: `{stop.name}`, once stopped, walks no more"
                yield loaded.problem((*keys, "stop", "for"), "SC050", message, "leave `for` out")


def _over_before(run: "_Run") -> Iterator[Problem]:
    """Steps of stories that wait for what happened before they are waited for, and for stories without time."""
    limit, needed = run.loaded.spec.time_limit, dict[int, float]()
    for number, step in enumerate(run.steps):
        own = 0.0 if step.when is None or step.when.edge == "falling" else step.when.delay + _earliest(step.when)
        needed[number] = own + (0.0 if step.after is None else needed[step.after])
        if step.after is None or not run.has_its_turn(step) or step.when is None:
            continue
        if needed[number] >= limit > own and needed[step.after] < limit:
            message = f"its story takes {needed[number]:g} s at least, and the run's time limit is {limit:g} s"
            problem = run.loaded.problem((*step.keys, "when"), "SC050", f"`{step.name}` can never happen: {message}")
            yield problem if step.required else replace(problem, severity="warning")
        for part in step.when.parts():
            name = getattr(part.event, "name", None)
            if name in run.before(step):
                message = f"`{step.name}` waits for `{name}`, which has happened before: a step waits for what comes"
                yield run.loaded.problem((*step.keys, "when"), "SC050", message)


@dataclass(frozen=True)
class _Run:
    """What a run can come to, when the events and faults of these names may happen."""

    loaded: LoadedScenario
    alive: frozenset[str]

    @cached_property
    def steps(self) -> list[Step]:
        return self.loaded.spec.steps

    def has_its_turn(self, step: Step) -> bool:
        """Whether the step before it in its story may happen."""
        return step.after is None or self.steps[step.after].name in self.alive

    def before(self, step: Step) -> frozenset[str]:
        """The names of the steps before it in its story."""
        if step.after is None:
            return frozenset()
        return self.before(self.steps[step.after]) | {self.steps[step.after].name}

    @property
    def possible(self) -> frozenset[str]:
        """The events and faults that may happen once those that are alive may; ever more, up to a fixed point."""
        orders = [
            *((step.when, step.name) for step in self.steps if self.has_its_turn(step)),
            *((fault.when, fault.label) for fault in self.loaded.spec.faults),
        ]
        happening = {name for when, name in orders if when is None or self.never(when, ()) is None}
        actions = [action for step in self.steps if step.name in happening for action in step.actions]
        return frozenset(
            happening | {getattr(action.chosen, "name", "") for action in actions if action.kind == "mark"}
        )

    def never(self, trigger: Trigger, keys: Keys) -> Why | None:
        """Why a trigger never fires."""
        limit = self.loaded.spec.time_limit
        if trigger.probability == 0:
            return (*keys, "probability"), "its probability is 0"
        if trigger.edge == "falling" and _latched(trigger):
            return (*keys, "edge"), "its condition never stops being true"
        earliest = trigger.delay + _earliest(trigger)
        if trigger.edge == "rising" and earliest >= limit:
            key = "delay" if trigger.delay else "for" if trigger.for_ else trigger.kind
            return (*keys, key), f"{earliest:g} s is not before the run's time limit of {limit:g} s"
        return self._why(trigger, keys)

    def _why(self, test: Test, keys: Keys) -> Why | None:
        if not self.loaded.concerns(test.robot):
            return None
        limit = self.loaded.spec.time_limit
        if test.for_ is not None and test.for_ >= limit:
            return (*keys, "for"), f"{test.for_:g} s is not less than the run's time limit of {limit:g} s"
        if test.all is not None:
            whys = self._whys(test.all, (*keys, "all"))
            return next((why for why in whys if why), None)
        if test.any is not None:
            whys = self._whys(test.any, (*keys, "any"))
            return whys[0] if all(whys) else None
        if test.not_ is not None:
            always = test.not_.time is not None and _earliest(test.not_) == 0
            return ((*keys, "not"), "what must not be true always is") if always else None
        check = _CHECKS.get(test.kind)
        why = check(self, test.chosen) if check else None
        return ((*keys, test.kind), why) if why else None

    def _whys(self, tests: Sequence[Test], keys: Keys) -> list[Why | None]:
        return [self._why(test, (*keys, k)) for k, test in enumerate(tests)]

    def does(self, *kinds: str) -> bool:
        """Whether an event that may happen does, or may do, any of these."""
        return any(action.may(*kinds) for step in self.steps if step.name in self.alive for action in step.actions)

    def sent(self, goal: str | None) -> int:
        """How many goals of a name (or at all) the robot can be sent."""
        own = [name for name in own_goal_names(self.loaded) if named(name, goal)]
        more = sum(
            1 if step.when is None else step.when.times
            for step in self.steps
            for action in step.actions
            if step.name in self.alive
            and action.kind == "new_goal"
            and self.loaded.concerns(action.robot)
            and goal in (None, getattr(action.chosen, "name", ""))
        )
        return len(own) + more

    def _time(self, time: Any) -> str | None:
        limit = self.loaded.spec.time_limit
        return f"{time.root:g} s is not before the run's time limit of {limit:g} s" if time.root >= limit else None

    def _travelled(self, travelled: Any) -> str | None:
        top, limit = self._top_speed, self.loaded.spec.time_limit
        if top is None or travelled.root <= FASTER * top * limit:
            return None
        return f"at its top speed of {top:g} m/s the robot drives {top * limit:g} m within the time limit"

    def _speed_above(self, speed: Any) -> str | None:
        top = self._top_speed
        if top is None or speed.root <= FASTER * top or self._may_be_rammed:
            return None
        return f"the robot's top speed is {top:g} m/s"

    def _turning_above(self, rate: Any) -> str | None:
        spec = self.loaded.robot.spec
        if spec is None or rate.root <= FASTER * spec.limits.angular or self._may_be_rammed or self.does("push"):
            return None
        return f"the robot turns at most at {spec.limits.angular:g} rad/s"

    def _distance_remaining(self, _: Any) -> str | None:
        return None if self.sent(None) else "the robot has no goal"

    def _localization_error(self, error: Any) -> str | None:
        stack = self.loaded.spec.stack
        told = isinstance(stack, StackSpec) and stack.told_truth
        return "the localizer is told the truth" if told and getattr(error, "root", error) >= LOST else None

    def _localization_lost(self, lost: Any) -> str | None:
        return self._localization_error(lost.tolerance) if lost.std is None else None

    def _goal(self, goal: Any) -> str | None:
        sent, whose = self.sent(goal.name), "" if goal.name is None else f" called `{goal.name}`"
        if goal.count > sent:
            return f"the robot is sent {sent or 'no'} goal{'' if sent == 1 else 's'}{whose}"
        if goal.status == "canceled" and not self.does("cancel_goal", "new_goal"):
            return "no event cancels a goal or sends another"
        if goal.status == "passed" and self.loaded.spec.navigation.mode != "navigate_through_poses":
            return "goals are passed in the mode navigate_through_poses alone"
        stops = self.loaded.spec.on_goal_failure == "stop" and not self.does("new_goal")
        if goal.status == "failed" and goal.count > 1 and stops:
            return "the run ends after the first goal that fails (`on_goal_failure: stop`)"
        return None

    def _waypoint(self, waypoint: Any) -> str | None:
        return self._goal(SimpleNamespace(status="reached", name=waypoint.name, count=waypoint.count))

    def _replan(self, _: Any) -> str | None:
        return None if self.sent(None) else "the robot has no goal to plan for"

    def _recovery(self, recovery: Any) -> str | None:
        return no_recovery(self.loaded, recovery.name) if self.sent(None) else "the robot has no goal to fail at"

    def _pedestrian(self, _: Any) -> str | None:
        return None if self.does("pedestrian", "crowd") else "no event lets a pedestrian come"

    def _event(self, event: Any) -> str | None:
        if event.name not in self.alive:
            return f"it waits for `{event.name}`, which never does"
        lasting = [fault for fault in self.loaded.spec.faults if fault.label == event.name and fault.for_ is None]
        if event.status == "ended" and lasting and event.name not in [step.name for step in self.steps]:
            return f"it waits for the end of fault `{event.name}`, which has no `for` and lasts to the end of the run"
        return None

    @property
    def _top_speed(self) -> float | None:
        spec = self.loaded.robot.spec
        return None if spec is None or self.does("push", "kidnap") else top_speed(spec)

    @property
    def _may_be_rammed(self) -> bool:
        world = self.loaded.world
        if world.spec is None or world.sdf is not None or self.loaded.other_robots:
            return True
        moving = self.does("move", "close", "open", "pedestrian", "crowd")
        return moving or any(thing.move for thing in world.spec.objects)


_CHECKS = {
    "time": _Run._time,
    "travelled": _Run._travelled,
    "speed_above": _Run._speed_above,
    "distance_remaining": _Run._distance_remaining,
    "believed_distance_remaining": _Run._distance_remaining,
    "turning_above": _Run._turning_above,
    "localization_error": _Run._localization_error,
    "localization_lost": _Run._localization_lost,
    "goal": _Run._goal,
    "waypoint": _Run._waypoint,
    "replan": _Run._replan,
    "recovery": _Run._recovery,
    "pedestrian": _Run._pedestrian,
    "event": _Run._event,
}


def top_speed(robot: RobotSpec) -> float:
    """In m/s over ground, in whichever direction it drives fastest."""
    limits = robot.limits
    ahead = max(limits.linear, limits.reverse or limits.linear)
    sideways = (limits.lateral or limits.linear) if isinstance(robot.drive, Holonomic) else 0.0
    return float((ahead**2 + sideways**2) ** 0.5)


def no_recovery(loaded: LoadedScenario, behaviour: str | None) -> str | None:
    """Why a recovery behaviour (any, for None) never runs."""
    if not isinstance(loaded.spec.stack, StackSpec):
        return None
    recovery = loaded.spec.stack.recovery
    if not recovery.behaviors or recovery.number_of_retries == 0:
        return "the stack has no recoveries"
    if behaviour is not None and behaviour not in recovery.names:
        return f"the stack's recoveries are {', '.join(dict.fromkeys(recovery.names))}"
    return None


def _latched(test: Test) -> bool:
    parts = test.all or test.any
    return all(map(_latched, parts)) if parts else test.kind in LATCHED


def _earliest(test: Test) -> float:
    """Seconds before which a condition does not count as true for sure."""
    return (test.for_ or 0.0) + _first_true(test)


def _first_true(test: Test) -> float:
    if test.all is not None:
        return max(map(_earliest, test.all))
    if test.any is not None:
        return min(map(_earliest, test.any))
    return float(test.chosen.root) if test.time is not None else 0.0  # type: ignore[attr-defined]


# MERGED: Orders to switch zones that a stack cannot be given, or that change nothing.
TOLD_HINT = "give it all zones from the start under `stack`, or take the event out"


def check_zone_actions(loaded: LoadedScenario) -> Iterator[Problem]:
    """Errors for what can never happen, warnings for what makes no difference."""
    orders: list[tuple[str, Keys, Any]] = [
        (step.name, (*keys, action.kind), action.chosen)
        for step in loaded.spec.steps
        for keys, action in step.placed()
        if action.kind in ("keepout", "speed_zone") and loaded.concerns(action.robot)
    ]
    for name, keys, order in orders:
        if isinstance(loaded.spec.stack, ExternalStackSpec):
            message = f"`{name}` can never happen: an external stack is told its zones once, at the start"
            yield loaded.problem_at(loaded.key_place_of(*keys), "SC050", message, TOLD_HINT)
        elif keys[-1] == "speed_zone" and order.enabled and order.region is not None:
            yield from _limit(loaded, name, keys, order, [other for _, _, other in orders])


def _limit(loaded: LoadedScenario, name: str, keys: Keys, order: Any, orders: list[Any]) -> Iterator[Problem]:
    zones = [zone.region for zone in loaded.spec.stack.speed_zones]
    given = [other.region for other in orders if getattr(other, "speed_limit", None)]
    if order.region not in (*zones, *given):
        message = f"`{name}` can never happen: region `{order.region}` has no speed limit"
        yield loaded.problem((*keys, "region"), "SC050", message, "say how fast: `speed_limit: 0.3 m/s`")
    robot = loaded.robot.spec
    if robot is not None and order.speed_limit is not None and order.speed_limit >= top_speed(robot):
        message = f"no limit: the robot's top speed is {top_speed(robot):g} m/s"
        yield replace(loaded.problem((*keys, "speed_limit"), "SC055", message), severity="warning")
