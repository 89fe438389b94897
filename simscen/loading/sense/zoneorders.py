"""Orders to switch zones that a stack cannot be given, or that change nothing."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from simscen.core.problems import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.sense.neverhappens import top_speed
from simscen.loading.tree import Key
from simscen.model.anystack import ExternalStackSpec

Keys = tuple[Key, ...]
TOLD_HINT = "give it all zones from the start under `stack`, or take the event out"


def vain_orders(loaded: LoadedScenario) -> Iterator[Problem]:
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
