"""What only the whole scenario can tell: do the names exist, do faults fit their sensors, do rates fit the clock?"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

from simscen.core.goalnames import LOOP
from simscen.core.problems import Problem
from simscen.core.time import Clock
from simscen.core.world import World
from simscen.loading.checks.criteria import never_holds
from simscen.loading.checks.events import check_zone_actions, never_happens, stopped_pedestrians
from simscen.loading.checks.faults import unfit_faults
from simscen.loading.checks.ineffective import hardly_fails
from simscen.loading.checks.robots import namesakes
from simscen.loading.checks.world_file import check_world_file
from simscen.loading.known_names import NOUNS, event_names, known_names, own_goal_names
from simscen.loading.loaded import LoadedScenario
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.spec_walk import references, walk
from simscen.loading.yaml.tree import Key, MappingNode, existing_keys, key_position, value_position
from simscen.model.navigation import failure_of
from simscen.model.robot import RobotSpec
from simscen.model.scenario import MOST_GOALS
from simscen.triggers.trigger import Test, Trigger

COMMAND = "cmd_vel"


def check_scenario(
    loaded: LoadedScenario, world: World | None = None, strangers: Iterable[Problem] = ()
) -> list[Problem]:
    """Every contradiction within a scenario and the files it names, and what deserves a look, as warnings.

    `world` is what its world file has become, `strangers` are places that are not among its own. Where names are
    unknown, no more is asked.
    """
    unknown = [*strangers, *_unknown_names(loaded, world), *unfit_faults(loaded), *_twice_named(loaded)]
    unknown += [*_uneven_rates(loaded), *_unknown_lidars(loaded), *namesakes(loaded, world), *_unfit_goals(loaded)]
    unknown += [loaded.sourced(problem) for problem in check_world_file(loaded.world)]
    unknown += _robots_and_things(loaded, world)
    if any(problem.severity == "error" for problem in unknown):
        return unknown
    checks = (
        _undecidable,
        _short_faults,
        never_happens,
        stopped_pedestrians,
        never_holds,
        hardly_fails,
        check_zone_actions,
    )
    return [*unknown, *(problem for check in checks for problem in check(loaded))]


def _unknown_names(loaded: LoadedScenario, world: World | None) -> Iterator[Problem]:
    known = known_names(loaded, world)
    for reference in references(loaded.spec, concerns=loaded.concerns):
        names = known.get(reference.to)
        if names is None or reference.name in names:
            continue
        own = (loaded.robot_name,) if reference.to == "movable" else ()
        robots = (*own, *loaded.other_robots)
        if reference.to in ("movable", "mover") and reference.name in (*robots, *(known["object"] or ())):
            what = "one of the robots" if reference.name in robots else "a fixed part of the world"
            message = f"{quoted(reference.name)} is {what}: it cannot move, go or be followed"
            yield loaded.problem(reference.keys, "SC035", message, "name an object, a door or what an event spawns")
            continue
        what = NOUNS[reference.to]
        hint = suggestion(reference.name, dict.fromkeys(names)) or "there is none at all"
        yield loaded.problem(reference.keys, "SC030", f"no {what} is called {quoted(reference.name)}", hint)


def _robots_and_things(loaded: LoadedScenario, world: World | None) -> Iterator[Problem]:
    """Robots that are called as a thing in the world is."""
    things = known_names(replace(loaded, other_robots=()), world)["object"] or ()
    if loaded.robot_name in things:
        message = f"something in the world is called {quoted(loaded.robot_name)}, too: nobody could tell them apart"
        yield loaded.problem_at(loaded.key_place_of("robot"), "SC033", message, "give the robot another name")


def _unknown_lidars(loaded: LoadedScenario) -> Iterator[Problem]:
    """Triggers that look at the scans of a lidar which the robot does not have."""
    if loaded.robot.spec is None:
        return
    lidars = [name for name, sensor in loaded.robot.spec.sensors.items() if sensor.says == "Scan"]
    for keys, part in walk(loaded.spec, concerns=loaded.concerns):
        named = getattr(part.scan_age, "sensor", None) if isinstance(part, Test) else None
        if named is not None and named not in lidars:
            message = f"robot `{loaded.robot.name}` has no lidar called {quoted(named)}"
            hint = suggestion(named, lidars) or "it has none at all"
            yield loaded.problem((*keys, "scan_age", "sensor"), "SC031", message, hint)


def _short_faults(loaded: LoadedScenario) -> Iterator[Problem]:
    """Faults shorter than the time between two messages of their sensor: those that are due between them hit none."""
    if loaded.robot.spec is None:
        return
    rates = {name: getattr(sensor.chosen, "rate", None) for name, sensor in loaded.robot.spec.sensors.items()}
    rates[COMMAND] = loaded.spec.stack.controller_frequency
    for index, entry in enumerate(loaded.spec.faults):
        rate = rates.get(entry.sensor)
        if entry.for_ is None or rate is None or entry.for_ * rate >= 1 - 1e-9:
            continue
        begin = _begin(entry.when)
        between = begin is not None and math.ceil(begin * rate - 1e-6) > (begin + entry.for_) * rate + 1e-6
        certainly = "begins and ends" if between else "may begin and end"
        message = f"`{entry.label}` {certainly} between two messages: `{entry.sensor}` has {rate:g} a second"
        hint = f"make it {1 / rate:g} s at least"
        problem = loaded.problem(("faults", index, "for"), "SC050", message, hint)
        if begin is None or between:
            yield problem if between and entry.required else replace(problem, severity="warning")


def _begin(when: Trigger | None) -> float | None:
    """The second in which a fault begins, where the clock alone decides."""
    if when is None:
        return 0.0
    return float(when.chosen.root) + when.delay if when.time is not None else None  # type: ignore[attr-defined]


def _twice_named(loaded: LoadedScenario) -> Iterator[Problem]:
    lists: dict[str, list[tuple[tuple[Key, ...], str | None]]] = {
        "goal": [(("goals", k), goal.name) for k, goal in enumerate(loaded.spec.goals)],
        "event": [(step.keys, step.entry.name) for step in loaded.spec.steps],
        "fault": [(("faults", k), fault.name) for k, fault in enumerate(loaded.spec.faults)],
    }
    for what, named in lists.items():
        seen: dict[str, tuple[Key, ...]] = {}
        for keys, name in named:
            if name is not None and name in seen:
                first = loaded.place_of(*seen[name], "name")
                message = f"{what} {quoted(name)} is there already (first at {first.line}:{first.col})"
                yield loaded.problem((*keys, "name"), "SC033", message, "give it another name")
            seen.setdefault(name or "", keys)
    yield from _goals_sent_twice(loaded)
    happening = [*event_names(loaded), *(fault.label for fault in loaded.spec.faults)]
    for keys, action in (placed for step in loaded.spec.steps for placed in step.placed()):
        name = getattr(action.chosen, "name", "") if action.kind == "mark" else ""
        if name in happening:
            message = f"an event or a fault is called {quoted(name)}, too: criteria could not tell them apart"
            yield loaded.problem((*keys, "mark", "name"), "SC033", message, "give one of them another name")
    for index, goal in enumerate(loaded.spec.goals):
        if goal.name is not None and LOOP.fullmatch(goal.name):
            message = f"{quoted(goal.name)} is what a goal is called in a further loop"
            yield loaded.problem(("goals", index, "name"), "SC033", message, "give it a name without # and a number")
    for index, fault in enumerate(loaded.spec.faults):
        if fault.name is not None and fault.name in event_names(loaded):
            message = f"an event is called {quoted(fault.name)}, too: criteria could not tell them apart"
            yield loaded.problem(("faults", index, "name"), "SC033", message, "give one of them another name")


def _unfit_goals(loaded: LoadedScenario) -> Iterator[Problem]:
    """What the mode of navigation leaves no room for, and more goals than a run takes."""
    spec = loaded.spec
    if len(spec.goals) * spec.navigation.loops > MOST_GOALS:
        message = f"{len(spec.goals)} goals in {spec.navigation.loops} loops are more than {MOST_GOALS}"
        yield loaded.problem(("navigation", "loops"), "SC016", message)
    for index, goal in enumerate(spec.goals[:-1] if spec.navigation.mode == "navigate_through_poses" else ()):
        for key, why in (("on_reached", "does not stop"), ("expect", "has no result")):
            if (
                goal.on_reached.wait if key == "on_reached" else failure_of(goal.expect)
            ) and key in goal.model_fields_set:
                message = f"`{key}` stands at the last goal of navigate_through_poses: at the others the robot {why}"
                yield loaded.problem(("goals", index, key), "SC016", message)


def _goals_sent_twice(loaded: LoadedScenario) -> Iterator[Problem]:
    taken = own_goal_names(loaded)
    for keys, action in (placed for step in loaded.spec.steps for placed in step.placed()):
        sent = action.kind == "new_goal" and loaded.concerns(action.robot)
        name = getattr(action.chosen, "name", "") if sent else ""
        if name in taken:
            message = f"a goal is called {quoted(name)} already: criteria could not tell them apart"
            yield loaded.problem((*keys, "new_goal", "name"), "SC033", message, "give it another name")
        taken += [name] if name else []


def _uneven_rates(loaded: LoadedScenario) -> Iterator[Problem]:
    clock = Clock(loaded.spec.physics.tick_rate)
    own: list[tuple[tuple[Key, ...], float]] = [
        (("stack", "controller_frequency"), loaded.spec.stack.controller_frequency),
        (("physics", "truth_rate"), loaded.spec.physics.truth_rate),
    ]
    for keys, rate in own:
        yield from _uneven(loaded, clock, loaded.tree, keys, rate)
    if isinstance(loaded.robot.spec, RobotSpec) and loaded.robot.tree is not None:
        for name, sensor in loaded.robot.spec.sensors.items():
            keys = ("sensors", name, sensor.kind, "rate")
            yield from _uneven(loaded, clock, loaded.robot.tree, keys, getattr(sensor.chosen, "rate", 1.0))


def _undecidable(loaded: LoadedScenario) -> Iterator[Problem]:
    for index, entry in enumerate(loaded.spec.pass_):
        horizon = getattr(entry.chosen, "horizon", 0.0)
        if horizon > loaded.spec.time_limit:
            looks = f"it looks {horizon:g} s ahead, but the time limit is {loaded.spec.time_limit:g} s"
            message = f"`{entry.kind}` can never hold: {looks}"
            yield loaded.problem_at(loaded.key_place_of("pass", index, entry.kind), "SC036", message)


def _uneven(
    loaded: LoadedScenario, clock: Clock, tree: MappingNode, keys: tuple[Key, ...], rate: float
) -> Iterator[Problem]:
    """A rate that does not divide the ticks, told where it is written, or else where the tick rate is."""
    try:
        clock.period(rate)
    except ValueError as error:
        tick_rate = ("physics", "tick_rate")
        if existing_keys(loaded.tree, tick_rate) == tick_rate:
            place = value_position(loaded.tree, tick_rate)
        else:
            place = value_position(tree, keys) if existing_keys(tree, keys) == keys else key_position(tree, keys)
        whose = "" if tree is loaded.tree else f" of robot `{loaded.robot.name}`"
        subject = ".".join(str(key) for key in keys) + whose
        yield loaded.problem_at(place, "SC034", f"{subject}: {error}")
