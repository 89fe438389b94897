"""Checks of single settings: rates, number of goals, duplicates, angles in degrees, and values without effect."""

import math
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from simscen.core.clock import Clock
from simscen.loading.checks.registry import MEANING, NAMES, CheckProblem, NameScope
from simscen.loading.loaded import LoadedScenario
from simscen.loading.spec_walk import angles_of
from simscen.loading.yaml.tree import Keys, MappingNode, ScalarNode, dotted_path, existing_keys, node_at
from simscen.model.localizers import Amcl
from simscen.model.navigation import expected_failure_name
from simscen.model.scenario import MAX_GOALS
from simscen.model.stack import StackSpec

TICK_RATE_KEYS = ("physics", "tick_rate")
"""Keys of the tick rate in a scenario."""


@NAMES.check("SC034")
def uneven_rates(scope: NameScope) -> Iterator[CheckProblem]:
    """Find rates that do not divide the tick rate. If the scenario sets the tick rate, the problem marks it."""
    loaded = scope.loaded
    rates: list[tuple[MappingNode | None, Keys, float]] = [
        (loaded.tree, ("stack", "controller_frequency"), loaded.spec.stack.controller_frequency),
        (loaded.tree, ("physics", "truth_rate"), loaded.spec.physics.truth_rate),
    ]
    if loaded.robot.spec is not None:  # without a YAML tree, it is inferred from a URDF
        rates += [
            (loaded.robot.tree, ("sensors", name, sensor.kind, "rate"), getattr(sensor.chosen, "rate", 1.0))
            for name, sensor in loaded.robot.spec.sensors.items()
        ]
    clock = Clock(loaded.spec.physics.tick_rate)
    for tree, keys, rate in rates:
        try:
            clock.period(rate)
        except ValueError as error:
            owner = "" if tree is loaded.tree else f" of robot `{loaded.robot.name}`"
            message = f"{'.'.join(map(str, keys))}{owner}: {error}"
            if tree is None or existing_keys(loaded.tree, TICK_RATE_KEYS) == TICK_RATE_KEYS:
                yield CheckProblem(TICK_RATE_KEYS, message)
            else:
                yield CheckProblem(keys, message, at_key=existing_keys(tree, keys) != keys, tree=tree)


@NAMES.check("SC016")
def goals_that_do_not_fit_the_mode(scope: NameScope) -> Iterator[CheckProblem]:
    """Find too many goals, and goals with keys that only the last goal of navigate_through_poses can have."""
    spec = scope.loaded.spec
    if len(spec.goals) * spec.navigation.loops > MAX_GOALS:
        message = f"{len(spec.goals)} goals in {spec.navigation.loops} loops exceed the limit of {MAX_GOALS} goals"
        yield CheckProblem(("navigation", "loops"), message)
    if spec.navigation.mode != "navigate_through_poses":
        return
    for index, goal in enumerate(spec.goals[:-1]):
        for key, value, reason in (
            ("on_reached", goal.on_reached.wait, "does not stop"),
            ("expect", expected_failure_name(goal.expect), "reports no result"),
        ):
            if value and key in goal.model_fields_set:
                message = f"only the last goal of navigate_through_poses can have `{key}`: elsewhere the robot {reason}"
                yield CheckProblem(("goals", index, key), message)


@NAMES.check("SC016")
def empty_ranges_of_the_local_costmap(scope: NameScope) -> Iterator[CheckProblem]:
    """Find minimums of the local costmap that exceed their maximums, after values of `costmap` are filled in."""
    stack = scope.loaded.spec.stack
    local = stack.local_costmap.with_defaults_from(stack.costmap) if isinstance(stack, StackSpec) else None
    if local is not None and (problem := local.range_problem()):
        message = f"{problem}; values that `local_costmap` does not set are those of `costmap`"
        yield CheckProblem(("stack", "local_costmap"), message)


FULL_TURN_RAD = 2 * math.pi
SPEED_PARAMETERS = ("desired_linear_vel", "max_vel_x", "vx_max")
"""Parameters of controllers for their forward speed, as in Nav2."""


@MEANING.check("SC052", severity="warning")
def late_timeouts(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find timeouts of goals that are longer than the time limit of the run."""
    limit = loaded.spec.time_limit
    for index, (goal, name) in enumerate(zip(loaded.spec.goals, loaded.spec.goal_names, strict=True)):
        if goal.timeout is not None and goal.timeout > limit:
            message = f"goal `{name}` never times out: the time limit ends the run after {limit:g} s"
            yield CheckProblem(("goals", index, "timeout"), message)


@MEANING.check("SC053", severity="warning")
def degrees_as_radians(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find angles above one turn without a unit in the scenario, world, or robot file. Report one angle per list."""
    files: list[tuple[BaseModel | None, MappingNode | None]] = [
        (loaded.spec, loaded.tree),
        (loaded.world.spec, loaded.world.tree),
        (loaded.robot.spec, loaded.robot.tree),
    ]
    for spec, tree in files:
        found: set[Keys] = set()
        for keys, value in angles_of(spec) if spec is not None and tree is not None else ():
            node = node_at(tree or loaded.tree, keys)
            has_no_unit = isinstance(node, ScalarNode) and isinstance(node.value, int | float)
            key_count = max(number for number, key in enumerate(keys, start=1) if isinstance(key, str))
            if has_no_unit and abs(value) > FULL_TURN_RAD + 1e-3 and keys[:key_count] not in found:
                found.add(keys[:key_count])
                written = f"{dotted_path(keys[key_count - 1 :])}: {value:g}"
                turns = value / FULL_TURN_RAD
                message = f"`{written}` is {turns:.1f} turns: angles without a unit are in radians"
                yield CheckProblem(keys, message, f"did you mean `{value:g} deg`?", tree=tree)


@MEANING.check("SC054", severity="warning")
def duplicate_entries(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find the same entry twice in one list."""
    spec = loaded.spec
    lists: list[tuple[Keys, list[Any]]] = [
        (("pass",), [(entry.kind, entry.chosen) for entry in spec.pass_]),
        (("events",), [(event.when, event.do, event.then) for event in spec.events]),
        (("faults",), [(f.sensor, f.kind, f.chosen, f.when, f.for_) for f in spec.faults]),
        (("tags",), list(spec.tags)),
        (("stack", "keepout"), list(spec.stack.keepout)),
        (("stack", "speed_zones"), [zone.region for zone in spec.stack.speed_zones]),
    ]
    for keys, entries in lists:
        for index, entry in enumerate(entries):
            if entry in entries[:index]:
                first = loaded.position_of(*keys, entries.index(entry))
                message = f"the same entry is already in `{keys[-1]}` at {first.line}:{first.col}"
                yield CheckProblem((*keys, index), message)


@MEANING.check("SC055", severity="warning")
def deprecated_parameters(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find parameters and values of earlier versions."""
    if getattr(loaded.spec.stack, "profile", None) == "simscen":
        yield CheckProblem(("stack", "profile"), "`simscen` is a deprecated name of this profile", "write `advanced`")
    localizer = getattr(loaded.spec.stack, "localizer", None)
    if isinstance(localizer, Amcl) and localizer.parameters is not None:
        message = "`parameters` is deprecated; `profile: nav2` has the default values of nav2_amcl"
        hint = "replace it by `laser_model_type: likelihood_field`"
        yield CheckProblem(("stack", "localizer", "parameters"), message, hint)


@MEANING.check("SC055", severity="warning")
def ignored_recovery_parameters(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find recovery parameters of AMCL that `relocalization: scan_matching` ignores."""
    localizer = getattr(loaded.spec.stack, "localizer", None)
    if getattr(localizer, "relocalization", None) != "scan_matching":
        return
    for key in ("recovery_alpha_slow", "recovery_alpha_fast"):
        keys = ("stack", "localizer", key)
        if getattr(localizer, key, 0.0) > 0.0 and existing_keys(loaded.tree, keys) == keys:
            hint = "use `relocalization: random` to find a lost robot as nav2_amcl does"
            yield CheckProblem(keys, f"`{key}` has no effect with `relocalization: scan_matching`", hint)


@MEANING.check("SC055", severity="warning")
def latency_without_values(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find `latency: robot` for a robot file without `latency`."""
    robot = loaded.robot.spec
    if getattr(loaded.spec.stack, "latency", None) != "robot":
        return
    if robot is None or "latency" not in robot.model_fields_set:
        message = f"the file of robot `{loaded.robot.name}` has no `latency`: computing takes no time"
        hint = "add `latency` to a *.robot.yaml, or write the durations here"
        yield CheckProblem(("stack", "latency"), message, hint)


@MEANING.check("SC055", severity="warning")
def speeds_above_the_top_speed(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find speed limits of zones, and maximum speeds of controllers, above the top speed of the robot."""
    robot, stack = loaded.robot.spec, loaded.spec.stack
    if robot is None:
        return
    for index, zone in enumerate(stack.speed_zones):
        if zone.speed_limit >= robot.top_speed:
            message = f"the limit has no effect: the robot's top speed is {robot.top_speed:g} m/s"
            yield CheckProblem(("stack", "speed_zones", index, "speed_limit"), message)
    for key in SPEED_PARAMETERS:
        speed = getattr(getattr(stack, "controller", None), key, None)
        if isinstance(speed, int | float) and speed > robot.limits.linear:
            message = f"the robot never drives {speed:g} m/s: its top speed is {robot.limits.linear:g} m/s"
            yield CheckProblem(("stack", "controller", key), message)
