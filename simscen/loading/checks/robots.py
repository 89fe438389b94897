"""Which of several robots something is about: names that are possible, known, and given where it matters."""

from collections.abc import Container, Iterator

from simscen.actions.action import AnyAction
from simscen.actions.base import Action
from simscen.core.problems import Problem
from simscen.core.world import World
from simscen.criteria.registry import verdict_names
from simscen.loading.known_names import world_object_names
from simscen.loading.loaded import LoadedScenario
from simscen.loading.multirobot import ROBOTS
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.spec_walk import Keys, walk
from simscen.loading.yaml.tree import MappingNode, key_position, value_position
from simscen.model.scenario import ScenarioSpec
from simscen.triggers.base import Condition
from simscen.triggers.trigger import Test


def check_robot_names(spec: ScenarioSpec, tree: MappingNode) -> Iterator[Problem]:
    """What is wrong with the robots that a scenario names, before each is looked at for itself."""
    for keys, part in walk({"events": spec.events, "faults": spec.faults, ROBOTS: spec.robots or {}}):
        if isinstance(part, Test | AnyAction) and part.robot is not None and part.robot not in (spec.robots or ()):
            yield _stranger(spec, tree, part.robot, (*keys, "robot"))
    if spec.robots:
        yield from _nobodys(spec, tree)
        yield from _never_judged(spec, tree)


def _stranger(spec: ScenarioSpec, tree: MappingNode, name: str, keys: Keys) -> Problem:
    message, hint = f"no robot is called {quoted(name)}", suggestion(name, spec.robots or ())
    if not spec.robots:
        message, hint = f"{message}: there is one only, which has no name", "remove `robot`"
    return Problem(*value_position(tree, keys), "SC030", message, hint)


def _nobodys(spec: ScenarioSpec, tree: MappingNode) -> Iterator[Problem]:
    """What is about a robot, and does not say which."""
    events = {step.name for step in spec.steps}
    faults = {fault.label for robot in (spec.robots or {}).values() for fault in robot.faults} - events
    for step in spec.steps:
        if step.when is not None:
            for keys, test in _bare(step.when, (*step.keys, "when"), faults):
                yield _unsaid(spec, tree, (*keys, test.kind), test.kind)
        for keys, action in step.placed():
            chosen = action.chosen
            assert isinstance(chosen, Action)
            if action.robot is None and chosen.of_a_robot:
                yield _unsaid(spec, tree, (*keys, action.kind), action.kind)


def _never_judged(spec: ScenarioSpec, tree: MappingNode) -> Iterator[Problem]:
    """What is expected to fail and no verdict of the run is called: those on a robot have its name before them."""
    known = [step.name for step in spec.steps]
    for name, robot in sorted((spec.robots or {}).items()):
        own = [*verdict_names([*spec.pass_, *robot.pass_]), *(fault.label for fault in robot.faults)]
        known += [f"{name}/{one}" for one in own]
    for number, expected in enumerate(spec.expected.criteria if spec.expected else ()):
        if expected not in known:
            meant = [one for one in known if one.partition("/")[2] == expected]
            hint = f"write {' or '.join(f'`{one}`' for one in meant)}" if meant else suggestion(expected, known)
            message = f"no criterion, event or fault is called {quoted(expected)}"
            yield Problem(*value_position(tree, ("expected", "criteria", number)), "SC030", message, hint)


def _bare(test: Test, keys: Keys, faults: Container[str]) -> Iterator[tuple[Keys, Test]]:
    """The conditions on a robot, or on a fault of it, that none is named for; `faults` are what these are called."""
    if test.robot is not None:
        return
    for key, inner in (("all", test.all), ("any", test.any)):
        for number, part in enumerate(inner or ()):
            yield from _bare(part, (*keys, key, number), faults)
    if test.not_ is not None:
        yield from _bare(test.not_, (*keys, "not"), faults)
    elif not test.inner:
        condition = test.chosen
        assert isinstance(condition, Condition)
        if condition.of_a_robot or (test.kind == "event" and getattr(condition, "name", "") in faults):
            yield keys, test


def _unsaid(spec: ScenarioSpec, tree: MappingNode, keys: Keys, kind: str) -> Problem:
    names = " or ".join(f"`robot: {name}`" for name in sorted(spec.robots or ()))
    message = f"`{kind}` is about a robot, and does not say which"
    return Problem(*key_position(tree, keys), "SC043", message, f"write {names} beside it")


# MERGED: People and other things of one name: who comes would replace what is there, or the other of them.
def namesakes(loaded: LoadedScenario, world: World | None = None) -> Iterator[Problem]:
    """Pedestrians, and those of crowds, who are called like something of the world or like one who comes before."""
    taken = dict.fromkeys(world_object_names(loaded, world), "something of the world")
    for step in loaded.spec.steps:
        for keys, action in step.placed():
            if action.kind not in ("spawn", "pedestrian", "crowd"):
                continue
            names = getattr(action.chosen, "names", None) or [getattr(action.chosen, "name", "")]
            twice = [name for name in names if name in taken]
            if twice and (action.kind != "spawn" or taken[twice[0]] == "somebody"):
                message = f"{taken[twice[0]]} is called {quoted(twice[0])} already"
                yield loaded.problem((*keys, action.kind, "name"), "SC033", message, "give one of them another name")
            taken.update(dict.fromkeys(names, "something" if action.kind == "spawn" else "somebody"))
