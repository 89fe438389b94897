"""Analysis of which events, faults, and marks of a scenario can happen (are feasible).

A step is an event, or a step of the sequence (`then`) of an event.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from simscen.core.messages.goals import matches_goal_name
from simscen.core.records.disturbances import BELIEF, KIND_BY_TARGET_NAME
from simscen.loading.known_names import listed_goal_names
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Keys
from simscen.model.stack import StackSpec

if TYPE_CHECKING:
    from simscen.model.disturbances import LocatedAction, SequenceStep
    from simscen.triggers.base import AnyCondition, Trigger

LocatedReason = tuple[Keys, str]
"""Keys of the part of a trigger that prevents the trigger from firing, and the reason as text for messages."""

LATCHING_CONDITIONS = frozenset(
    {"time", "travelled", "goal", "waypoint", "replan", "recovery", "collision", "pedestrian", "event"}
)
"""Kinds of conditions that stay true after they have become true."""
MAX_SPEED_RATIO = 1.1
"""Upper bound on the speed of a robot, divided by its top speed. It is above 1 because robots overshoot."""
MAX_TRUTH_ERROR_M = 0.5
"""Upper bound on the localization error if the stack gets the true pose."""


def no_recovery_reason(loaded: LoadedScenario, behavior: str | None) -> str | None:
    """Return the reason why a recovery behavior never runs; None if it can run. `behavior` is None for any behavior."""
    if not isinstance(loaded.spec.stack, StackSpec):
        return None
    recovery = loaded.spec.stack.recovery
    if not recovery.behaviors or recovery.number_of_retries == 0:
        return "the stack has no recovery behaviors"
    if behavior is not None and behavior not in recovery.names:
        return f"the stack's recovery behaviors are {', '.join(dict.fromkeys(recovery.names))}"
    return None


def analyze_events(loaded: LoadedScenario) -> EventFeasibility:
    """Return which events, faults, and marks can happen.

    The search starts with an empty set, and adds steps whose triggers can fire, until nothing is added.
    """
    analysis = EventFeasibility(loaded, frozenset())
    while (feasible := analysis.next_feasible) != analysis.feasible:
        analysis = replace(analysis, feasible=feasible)
    return analysis


@dataclass(frozen=True)
class EventFeasibility:
    """Analysis under the assumption that the events, faults, and marks with the names `feasible` can happen.

    A kind of condition that can be infeasible has a method `_infeasibility_of_KIND`, such as `_infeasibility_of_goal`.
    The method takes the specification of a condition, and returns the reason why the condition can never be true; None
    if it can be true.
    """

    loaded: LoadedScenario
    feasible: frozenset[str]

    @cached_property
    def steps(self) -> list[SequenceStep]:
        """The events of the scenario, each followed by the steps of its sequence."""
        return self.loaded.spec.steps

    @property
    def triggers(self) -> Iterator[tuple[Keys, Trigger | None, str, bool]]:
        """(keys of the trigger, trigger, name, `required`) of each reachable step, and then of each fault."""
        for step in self.steps:
            if self.is_reachable(step):
                yield (*step.keys, "when"), step.when, step.name, step.required
        for index, fault in enumerate(self.loaded.spec.faults):
            yield ("faults", index, "when"), fault.when, fault.label, fault.required

    def is_reachable(self, step: SequenceStep) -> bool:
        """Return whether the previous step of the same sequence can happen; True for an event."""
        return step.after is None or self.steps[step.after].name in self.feasible

    def earlier_steps(self, step: SequenceStep) -> frozenset[str]:
        """Return the names of the steps before `step` in its sequence."""
        if step.after is None:
            return frozenset()
        return self.earlier_steps(self.steps[step.after]) | {self.steps[step.after].name}

    @property
    def next_feasible(self) -> frozenset[str]:
        """Names of the events, faults, and marks that can happen if those in `feasible` can happen."""
        names = {name for keys, when, name, _ in self.triggers if when is None or not self.infeasibility(when, keys)}
        actions = (action for step in self.steps if step.name in names for action in step.actions)
        return frozenset(names | {action.spec.name for action in actions if action.kind == "mark"})

    def infeasibility(self, trigger: Trigger, keys: Keys) -> LocatedReason | None:
        """Return the reason why the trigger at `keys` never fires; None if it can fire."""
        limit = self.loaded.spec.time_limit
        if trigger.probability == 0:
            return (*keys, "probability"), "its probability is 0"
        if trigger.edge == "falling" and stays_true(trigger):
            return (*keys, "edge"), "its condition stays true, so it has no falling edge"
        earliest = trigger.delay + earliest_true_s(trigger)
        if trigger.edge == "rising" and earliest >= limit:
            key = "delay" if trigger.delay else "for" if trigger.for_ else trigger.kind
            return (*keys, key), f"{earliest:g} s is not before the time limit of {limit:g} s"
        return self._never_true_reason(trigger, keys)

    def _never_true_reason(self, condition: AnyCondition, keys: Keys) -> LocatedReason | None:
        """Return the reason why the condition at `keys` is never true; None if it can be true."""
        if not self.loaded.includes_robot(condition.robot):
            return None
        limit = self.loaded.spec.time_limit
        if condition.for_ is not None and condition.for_ >= limit:
            return (*keys, "for"), f"{condition.for_:g} s is not less than the time limit of {limit:g} s"
        if condition.all is not None:
            reasons = [self._never_true_reason(part, (*keys, "all", k)) for k, part in enumerate(condition.all)]
            return next(filter(None, reasons), None)
        if condition.any is not None:
            reasons = [self._never_true_reason(part, (*keys, "any", k)) for k, part in enumerate(condition.any)]
            return reasons[0] if all(reasons) else None
        if condition.not_ is not None:
            always = condition.not_.time is not None and earliest_true_s(condition.not_) == 0
            return ((*keys, "not"), "the condition under `not` is always true") if always else None
        find_reason = getattr(self, f"_infeasibility_of_{condition.kind}", None)
        reason = find_reason(condition.chosen) if find_reason else None
        return ((*keys, condition.kind), reason) if reason else None

    @property
    def _feasible_actions(self) -> list[LocatedAction]:
        return [action for step in self.steps if step.name in self.feasible for action in step.actions]

    def may_do(self, *kinds: str) -> bool:
        """Return whether a feasible step has an action of one of these kinds, or an action of a plug-in."""
        return any(action.choice.may_do(*kinds) for action in self._feasible_actions)

    def goal_count(self, goal: str | None) -> int:
        """Return how many goals with this name the robot can get. `goal` is None for any name."""
        listed = [name for name in listed_goal_names(self.loaded) if matches_goal_name(name, goal)]
        sent = sum(
            1 if action.step.when is None else action.step.when.times
            for action in self._feasible_actions
            if action.kind == "new_goal"
            and self.loaded.includes_robot(action.choice.robot)
            and goal in (None, action.spec.name)
        )
        return len(listed) + sent

    def _infeasibility_of_time(self, time: Any) -> str | None:
        limit = self.loaded.spec.time_limit
        return f"{time.root:g} s is not before the time limit of {limit:g} s" if time.root >= limit else None

    def _infeasibility_of_travelled(self, travelled: Any) -> str | None:
        top, limit = self._top_speed, self.loaded.spec.time_limit
        if top is None or travelled.root <= MAX_SPEED_RATIO * top * limit:
            return None
        return f"at its top speed of {top:g} m/s the robot drives {top * limit:g} m within the time limit"

    def _infeasibility_of_speed_above(self, speed: Any) -> str | None:
        top = self._top_speed
        if top is None or speed.root <= MAX_SPEED_RATIO * top:
            return None
        return f"the robot's top speed is {top:g} m/s"

    def _infeasibility_of_turning_above(self, rate: Any) -> str | None:
        spec = self.loaded.robot.spec
        if spec is None or self._may_be_pushed or rate.root <= MAX_SPEED_RATIO * spec.limits.angular:
            return None
        return f"the robot's maximum turn rate is {spec.limits.angular:g} rad/s"

    def _infeasibility_of_distance_remaining(self, _: Any) -> str | None:
        return None if self.goal_count(None) else "the robot has no goal"

    _infeasibility_of_believed_distance_remaining = _infeasibility_of_distance_remaining

    def _infeasibility_of_localization_error(self, error: Any) -> str | None:
        stack = self.loaded.spec.stack
        targets = [KIND_BY_TARGET_NAME.get(fault.sensor) for fault in self.loaded.spec.faults]
        is_displaced = self.may_do("kidnap") or BELIEF in targets
        gets_truth = isinstance(stack, StackSpec) and stack.gets_ground_truth and not is_displaced
        too_large = getattr(error, "root", error) >= MAX_TRUTH_ERROR_M
        return "the localizer gets the true pose" if gets_truth and too_large else None

    def _infeasibility_of_localization_lost(self, lost: Any) -> str | None:
        return self._infeasibility_of_localization_error(lost.tolerance) if lost.std is None else None

    def _infeasibility_of_goal(self, goal: Any) -> str | None:
        count, suffix = self.goal_count(goal.name), "" if goal.name is None else f" called `{goal.name}`"
        if goal.count > count:
            return f"the robot gets {f'only {count}' if count else 'no'} goal{'' if count == 1 else 's'}{suffix}"
        if goal.status == "canceled" and not self.may_do("cancel_goal", "new_goal"):
            return "no event cancels a goal or sends another one"
        if goal.status == "passed" and self.loaded.spec.navigation.mode != "navigate_through_poses":
            return "goals are only passed in the mode navigate_through_poses"
        stops = self.loaded.spec.on_goal_failure == "stop" and not self.may_do("new_goal")
        if goal.status == "failed" and goal.count > 1 and stops:
            return "the run ends after the first failed goal (`on_goal_failure: stop`)"
        return None

    def _infeasibility_of_waypoint(self, waypoint: Any) -> str | None:
        return self._infeasibility_of_goal(SimpleNamespace(status="reached", name=waypoint.name, count=waypoint.count))

    def _infeasibility_of_replan(self, _: Any) -> str | None:
        return None if self.goal_count(None) else "the robot has no goal to plan for"

    def _infeasibility_of_recovery(self, recovery: Any) -> str | None:
        if not self.goal_count(None):
            return "the robot has no goal to recover for"
        return no_recovery_reason(self.loaded, recovery.name)

    def _infeasibility_of_pedestrian(self, _: Any) -> str | None:
        return None if self.may_do("pedestrian", "crowd") else "no event adds a pedestrian"

    def _infeasibility_of_event(self, event: Any) -> str | None:
        if event.name not in self.feasible:
            return f"it waits for `{event.name}`, which can never happen"
        lasting = [fault for fault in self.loaded.spec.faults if fault.label == event.name and fault.for_ is None]
        if event.status == "ended" and lasting and event.name not in [step.name for step in self.steps]:
            return f"it waits for the end of fault `{event.name}`, which lasts to the end of the run (it has no `for`)"
        return None

    @property
    def _top_speed(self) -> float | None:
        """Top speed of the robot in m/s; None if it is unknown, or if something can make the robot faster."""
        spec = self.loaded.robot.spec
        return None if spec is None or self._may_be_pushed or self.may_do("kidnap") else spec.top_speed

    @property
    def _may_be_pushed(self) -> bool:
        """Whether an action, a pedestrian, another robot, or an object that moves or appears could push the robot."""
        world = self.loaded.world
        if world.spec is None or world.sdf is not None or self.loaded.other_robots:
            return True
        pushing = self.may_do("push", "move", "close", "open", "pedestrian", "crowd", "spawn", "teleport")
        return pushing or any(world_object.move for world_object in world.spec.objects)


def stays_true(condition: AnyCondition) -> bool:
    """Return whether a condition stays true after it has become true."""
    parts = condition.all or condition.any
    return all(map(stays_true, parts)) if parts else condition.kind in LATCHING_CONDITIONS


def earliest_true_s(condition: AnyCondition) -> float:
    """Return the earliest time in s at which a condition can have been true for its duration `for`."""
    if condition.all is not None:
        earliest = max(map(earliest_true_s, condition.all))
    elif condition.any is not None:
        earliest = min(map(earliest_true_s, condition.any))
    else:
        earliest = float(condition.chosen.root) if condition.time is not None else 0.0
    return (condition.for_ or 0.0) + earliest
