"""Checks for values that have no effect, entries that are listed twice, and angles in degrees."""

import math
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from simscen.loading.checks.registry import MEANING, Finding, Keys
from simscen.loading.loaded import LoadedScenario
from simscen.loading.spec_walk import quantities_of
from simscen.loading.yaml.tree import MappingNode, ScalarNode, node_at
from simscen.model.localizers import Amcl

FULL_TURN_RAD = 2 * math.pi
SPEED_PARAMETERS = ("desired_linear_vel", "max_vel_x", "vx_max")
"""Speeds of Nav2's controllers."""


@MEANING.check("SC052", severity="warning")
def late_timeouts(loaded: LoadedScenario) -> Iterator[Finding]:
    """Find timeouts of goals after the end of the run."""
    limit = loaded.spec.time_limit
    for index, (goal, name) in enumerate(zip(loaded.spec.goals, loaded.spec.goal_names, strict=True)):
        if goal.timeout is not None and goal.timeout > limit:
            message = f"goal `{name}` never times out: the time limit ends the run after {limit:g} s"
            yield Finding(("goals", index, "timeout"), message)


@MEANING.check("SC053", severity="warning")
def degrees_as_radians(loaded: LoadedScenario) -> Iterator[Finding]:
    """Find angles of more than one turn without a unit, in the scenario, its world, and its own robot file."""
    files: list[tuple[BaseModel | None, MappingNode | None]] = [
        (loaded.spec, loaded.tree),
        (loaded.world.spec, loaded.world.tree),
    ]
    if not loaded.robot.bundled:
        files.append((loaded.robot.spec, loaded.robot.tree))
    for spec, tree in files:
        for keys, value in quantities_of(spec, "angle") if spec is not None and tree is not None else ():
            node = node_at(tree or loaded.tree, keys)
            without_unit = isinstance(node, ScalarNode) and isinstance(node.value, int | float)
            if without_unit and abs(value) > FULL_TURN_RAD + 1e-3:
                turns = value / FULL_TURN_RAD
                message = f"`{keys[-1]}: {value:g}` is {turns:.1f} turns: angles without a unit are in radians"
                yield Finding(keys, message, f"did you mean `{value:g} deg`?", tree=tree)


@MEANING.check("SC054", severity="warning")
def duplicate_entries(loaded: LoadedScenario) -> Iterator[Finding]:
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
                first = loaded.place_of(*keys, entries.index(entry))
                message = f"the same entry is already in `{keys[-1]}` at {first.line}:{first.col}"
                yield Finding((*keys, index), message)


@MEANING.check("SC055", severity="warning")
def deprecated_parameters(loaded: LoadedScenario) -> Iterator[Finding]:
    """Find parameters that earlier versions had and that no longer have an effect."""
    if getattr(loaded.spec.stack, "profile", None) == "simscen":
        yield Finding(("stack", "profile"), "`simscen` is a deprecated name of this profile", "write `advanced`")
    localizer = getattr(loaded.spec.stack, "localizer", None)
    if isinstance(localizer, Amcl) and localizer.parameters is not None:
        message = "`parameters` is deprecated: `amcl` always has the default values of nav2_amcl"
        yield Finding(("stack", "localizer", "parameters"), message, "remove it")


@MEANING.check("SC055", severity="warning")
def latency_without_values(loaded: LoadedScenario) -> Iterator[Finding]:
    """Find `latency: robot` for a robot whose file gives no latency."""
    robot = loaded.robot.spec
    if getattr(loaded.spec.stack, "latency", None) != "robot":
        return
    if robot is None or "latency" not in robot.model_fields_set:
        message = f"the file of robot `{loaded.robot.name}` has no `latency`: computing takes no time"
        yield Finding(("stack", "latency"), message, "add `latency` to a *.robot.yaml, or write the durations here")


@MEANING.check("SC055", severity="warning")
def speeds_above_the_top_speed(loaded: LoadedScenario) -> Iterator[Finding]:
    """Find speed limits of zones and speeds of controllers that the robot cannot reach."""
    robot, stack = loaded.robot.spec, loaded.spec.stack
    if robot is None:
        return
    for index, zone in enumerate(stack.speed_zones):
        if zone.speed_limit >= robot.top_speed:
            message = f"the limit has no effect: the robot's top speed is {robot.top_speed:g} m/s"
            yield Finding(("stack", "speed_zones", index, "speed_limit"), message)
    for key in SPEED_PARAMETERS:
        wanted = getattr(getattr(stack, "controller", None), key, None)
        if isinstance(wanted, int | float) and wanted > robot.limits.linear:
            message = f"the robot never drives {wanted:g} m/s: its top speed is {robot.limits.linear:g} m/s"
            yield Finding(("stack", "controller", key), message)
