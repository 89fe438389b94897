"""Which of several robots something is about: names that are possible, known, and given where it matters."""

from collections.abc import Iterator

from simscen.actions.action import AnyAction
from simscen.actions.base import Action
from simscen.core.problems import Problem
from simscen.loading.messages import quoted, suggestion
from simscen.loading.sense.specwalk import Keys, below
from simscen.loading.tree import Fields, key_place, value_place
from simscen.model.anystack import ExternalStackSpec
from simscen.model.scenario import ScenarioSpec
from simscen.triggers.base import Condition
from simscen.triggers.trigger import Test


def whose(spec: ScenarioSpec, tree: Fields) -> Iterator[Problem]:
    """What is wrong with the robots of a scenario of several, before each is looked at for itself."""
    known = spec.robots or {}
    for name, robot in known.items():
        if isinstance(robot.stack if robot.stack is not None else spec.stack, ExternalStackSpec):
            keys: Keys = ("robots", name, "stack") if robot.stack is not None else ("stack",)
            hint = "each robot needs a stack in the engine: `reference`, or one of an installed package"
            message = "an external stack drives one robot, and here are several"
            yield Problem(*key_place(tree, keys), "SC042", message, hint)
    for keys, part in below(spec):
        if not isinstance(part, Test | AnyAction):
            continue
        if part.robot is not None and part.robot not in known:
            place, message = value_place(tree, (*keys, "robot")), f"no robot is called {quoted(part.robot)}"
            yield Problem(*place, "SC030", message, suggestion(part.robot, known))
    yield from _nobodys(spec, tree)


def only(spec: ScenarioSpec, tree: Fields) -> Iterator[Problem]:
    """Where a scenario of one robot names one."""
    for keys, part in below(spec):
        if isinstance(part, Test | AnyAction) and part.robot is not None:
            message = f"no robot is called {quoted(part.robot)}: there is one only, which has no name"
            yield Problem(*value_place(tree, (*keys, "robot")), "SC030", message, "remove `robot`")


def _nobodys(spec: ScenarioSpec, tree: Fields) -> Iterator[Problem]:
    """What is about a robot, and does not say which."""
    for step in spec.steps:
        if step.when is not None:
            for keys, test in _bare(step.when, (*step.keys, "when")):
                yield _unsaid(spec, tree, (*keys, test.kind), test.kind)
        for keys, action in step.placed():
            chosen = action.chosen
            assert isinstance(chosen, Action)
            if action.robot is None and chosen.of_a_robot:
                yield _unsaid(spec, tree, (*keys, action.kind), action.kind)


def _bare(test: Test, keys: Keys) -> Iterator[tuple[Keys, Test]]:
    """The conditions on a robot that none is named for."""
    if test.robot is not None:
        return
    for key, inner in (("all", test.all), ("any", test.any)):
        for number, part in enumerate(inner or ()):
            yield from _bare(part, (*keys, key, number))
    if test.not_ is not None:
        yield from _bare(test.not_, (*keys, "not"))
    elif not test.inner:
        condition = test.chosen
        assert isinstance(condition, Condition)
        if condition.of_a_robot:
            yield keys, test


def _unsaid(spec: ScenarioSpec, tree: Fields, keys: Keys, kind: str) -> Problem:
    names = " or ".join(f"`robot: {name}`" for name in sorted(spec.robots or ()))
    message = f"`{kind}` is about a robot, and does not say which"
    return Problem(*key_place(tree, keys), "SC043", message, f"write {names} beside it")
