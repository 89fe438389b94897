"""Checks of a scenario with several robots: which robot is meant, and does it exist?"""

from collections.abc import Container, Iterator

from simscen.actions.base import Action
from simscen.actions.registry import AnyAction
from simscen.criteria.registry import verdict_names
from simscen.loading.checks.registry import ROBOT_NAMES, Finding, Keys, WrittenScenario
from simscen.loading.multirobot import ROBOTS
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.spec_walk import walk
from simscen.triggers.base import Condition
from simscen.triggers.registry import AnyCondition


@ROBOT_NAMES.check("SC030")
def unknown_robots(scenario: WrittenScenario) -> Iterator[Finding]:
    """Find triggers and actions with the name of a robot that does not exist."""
    spec = scenario.spec
    robots = spec.robots or {}
    for keys, part in walk({"events": spec.events, "faults": spec.faults, ROBOTS: robots}):
        if not isinstance(part, AnyCondition | AnyAction) or part.robot is None or part.robot in robots:
            continue
        message, hint = f"no robot is called {quoted(part.robot)}", suggestion(part.robot, robots)
        if not robots:
            message, hint = f"{message}: the only robot has no name", "remove `robot`"
        yield Finding((*keys, "robot"), message, hint)


@ROBOT_NAMES.check("SC043")
def missing_robots(scenario: WrittenScenario) -> Iterator[Finding]:
    """Find triggers and actions on a robot that do not name one of several."""
    spec = scenario.spec
    if not spec.robots:
        return
    events = {step.name for step in spec.steps}
    faults = {fault.label for robot in spec.robots.values() for fault in robot.faults} - events
    hint = f"add {' or '.join(f'`robot: {name}`' for name in sorted(spec.robots))}"
    for step in spec.steps:
        unnamed = [] if step.when is None else list(_tests_without_robot(step.when, (*step.keys, "when"), faults))
        for keys, action in step.located_actions():
            assert isinstance(action.chosen, Action)
            if action.robot is None and action.chosen.is_robot_specific:
                unnamed.append((keys, action.kind))
        for keys, kind in unnamed:
            yield Finding((*keys, kind), f"`{kind}` must name one of the robots", hint, at_key=True)


def _tests_without_robot(test: AnyCondition, keys: Keys, faults: Container[str]) -> Iterator[tuple[Keys, str]]:
    """Yield keys and kind of each condition on a robot, or on a fault of a robot, that names no robot."""
    if test.robot is not None:
        return
    for key, inner in (("all", test.all), ("any", test.any)):
        for number, part in enumerate(inner or ()):
            yield from _tests_without_robot(part, (*keys, key, number), faults)
    if test.not_ is not None:
        yield from _tests_without_robot(test.not_, (*keys, "not"), faults)
    elif not test.inner:
        condition = test.chosen
        assert isinstance(condition, Condition)
        if condition.is_robot_specific or (test.kind == "event" and getattr(condition, "name", "") in faults):
            yield keys, test.kind


@ROBOT_NAMES.check("SC030")
def unknown_expected_verdicts(scenario: WrittenScenario) -> Iterator[Finding]:
    """Find names under `expected.criteria` that no verdict has; a robot's verdicts begin with `<robot>/`."""
    spec = scenario.spec
    if not spec.robots:
        return
    known = [step.name for step in spec.steps]
    for name, robot in sorted(spec.robots.items()):
        own = [*verdict_names([*spec.pass_, *robot.pass_]), *(fault.label for fault in robot.faults)]
        known += [f"{name}/{one}" for one in own]
    for number, expected in enumerate(spec.expected.criteria if spec.expected else ()):
        if expected not in known:
            meant = [one for one in known if one.partition("/")[2] == expected]
            hint = f"write {' or '.join(f'`{one}`' for one in meant)}" if meant else suggestion(expected, known)
            message = f"no criterion, event or fault is called {quoted(expected)}"
            yield Finding(("expected", "criteria", number), message, hint)
