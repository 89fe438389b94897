"""Checks of rates and of the goal list."""

from collections.abc import Iterator

from simscen.core.clock import Clock
from simscen.loading.checks.registry import NAMES, Finding, Keys, NameScope
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import MappingNode, existing_keys
from simscen.model.navigation import expected_failure_name
from simscen.model.robot import RobotSpec
from simscen.model.scenario import MAX_GOALS

TICK_RATE = ("physics", "tick_rate")


@NAMES.check("SC034")
def uneven_rates(scope: NameScope) -> Iterator[Finding]:
    """Find rates that do not divide the physics rate."""
    loaded = scope.loaded
    rates: list[tuple[MappingNode, Keys, float]] = [
        (loaded.tree, ("stack", "controller_frequency"), loaded.spec.stack.controller_frequency),
        (loaded.tree, ("physics", "truth_rate"), loaded.spec.physics.truth_rate),
    ]
    if isinstance(loaded.robot.spec, RobotSpec) and loaded.robot.tree is not None:
        rates += [
            (loaded.robot.tree, ("sensors", name, sensor.kind, "rate"), getattr(sensor.chosen, "rate", 1.0))
            for name, sensor in loaded.robot.spec.sensors.items()
        ]
    clock = Clock(loaded.spec.physics.tick_rate)
    for tree, keys, rate in rates:
        try:
            clock.period(rate)
        except ValueError as error:
            yield _uneven(loaded, tree, keys, str(error))


def _uneven(loaded: LoadedScenario, tree: MappingNode, keys: Keys, error: str) -> Finding:
    """Return the finding at the tick rate if that is written, else at the rate or where the rate would be."""
    owner = "" if tree is loaded.tree else f" of robot `{loaded.robot.name}`"
    message = f"{'.'.join(str(key) for key in keys)}{owner}: {error}"
    if existing_keys(loaded.tree, TICK_RATE) == TICK_RATE:
        return Finding(TICK_RATE, message)
    return Finding(keys, message, at_key=existing_keys(tree, keys) != keys, tree=tree)


@NAMES.check("SC016")
def goals_that_do_not_fit_the_mode(scope: NameScope) -> Iterator[Finding]:
    """Find more goals than a run may have, and keys that only the last goal of a drive through poses can have."""
    spec = scope.loaded.spec
    if len(spec.goals) * spec.navigation.loops > MAX_GOALS:
        message = f"{len(spec.goals)} goals in {spec.navigation.loops} loops exceed the limit of {MAX_GOALS} goals"
        yield Finding(("navigation", "loops"), message)
    if spec.navigation.mode != "navigate_through_poses":
        return
    for index, goal in enumerate(spec.goals[:-1]):
        for key, used, why in (
            ("on_reached", goal.on_reached.wait, "does not stop"),
            ("expect", expected_failure_name(goal.expect), "reports no result"),
        ):
            if used and key in goal.model_fields_set:
                message = f"only the last goal of navigate_through_poses can have `{key}`: elsewhere the robot {why}"
                yield Finding(("goals", index, key), message)
