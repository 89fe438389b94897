"""Translates the parameters of Nav2's nodes to parameters of simscen's reference stack.

There is one function for each kind of node. `parameters` are the parameters of the node in the Nav2 file.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from simscen.loading.stacks.nav2_costmaps import translate_costmap
from simscen.loading.stacks.nav2_mapping import (
    EQUIVALENT_VALUES,
    IGNORED_NAME_PARTS,
    IGNORED_NODES,
    IGNORED_PARAMETERS,
    MOTION_MODELS,
    OLD_NODE_NAMES,
    SCENARIO_PARAMETERS,
    Parameters,
    Translation,
    class_of,
    strings,
    translate_same_name,
)
from simscen.loading.stacks.nav2_plugins import translate_controller_server, translate_planner_server
from simscen.spec.quantities import MAX_DURATION_S


def _translate_velocity_smoother(parameters: Parameters) -> Iterator[Translation]:
    """Translate the limits of forward motion and turning. Other limits get a note if they differ."""
    angular_names = {"max_velocity": "max_angular_velocity", "max_accel": "max_angular_accel", "max_decel": ""}
    for name, angular_name in angular_names.items():
        limits = _xy_and_rotation(parameters.get(name))
        for simscen_name, limit in zip((name, angular_name), limits[::2], strict=True) if limits else ():
            if simscen_name and limit:
                yield Translation(name, ("velocity_smoother", simscen_name), abs(limit))
        if limits and limits[1] and abs(limits[1]) != abs(limits[0]):
            yield Translation(name, (), limits, "lateral motion has the same limit as forward motion")
    lowest, highest = _xy_and_rotation(parameters.get("min_velocity")), _xy_and_rotation(parameters.get("max_velocity"))
    if lowest:
        is_same = bool(highest) and all(low in (-high, 0) for low, high in zip(lowest, highest, strict=True))
        note = "" if is_same else "backward motion has the same limit as forward motion"
        yield Translation("min_velocity", (), lowest, note)
    accelerations = _xy_and_rotation(parameters.get("max_accel"))
    decelerations = _xy_and_rotation(parameters.get("max_decel"))
    if accelerations and decelerations and abs(decelerations[2]) != abs(accelerations[2]):
        note = "angular deceleration has the same limit as angular acceleration"
        yield Translation("max_decel", (), decelerations, note)


def _translate_collision_monitor(parameters: Parameters) -> Iterator[Translation]:
    """Translate the first enabled `approach` polygon. Other enabled polygons get a note."""
    timeout = parameters.get("source_timeout")
    if timeout is not None:
        is_off = timeout == 0 and not isinstance(timeout, bool)
        timeout = MAX_DURATION_S if is_off else timeout
        yield Translation("source_timeout", ("collision_monitor", "source_timeout"), timeout)
    is_enabled = parameters.get("enabled", True)
    actions = {polygon: parameters.get(f"{polygon}.action_type") for polygon in strings(parameters.get("polygons"))}
    enabled = {polygon: parameters.get(f"{polygon}.enabled", True) for polygon in actions}
    approaching = {polygon: enabled[polygon] for polygon in actions if actions[polygon] == "approach"}
    used = max(approaching, key=lambda polygon: bool(approaching[polygon]), default="")  # the first enabled one, if any
    for polygon, action in actions.items():
        if polygon == used:
            yield from (Translation(f"{polygon}.{setting}", (), None) for setting in ("action_type", "enabled"))
            yield from _translate_approach(parameters, polygon)
        elif enabled[polygon]:
            note = f"action_type {action} of {polygon} is not supported"
            if polygon in approaching:
                note = f"only the first polygon with the action_type approach is used: {used}, not {polygon}"
            yield Translation("polygons", (), action, note, covers=f"{polygon}.")
        else:
            yield Translation("polygons", (), action, covers=f"{polygon}.")  # disabled
    is_enabled = is_enabled and (any(approaching.values()) or not approaching)
    for name in ("enabled", "polygons"):
        if name in parameters:
            yield Translation(name, ("collision_monitor", "enabled"), is_enabled)
            break


def _translate_approach(parameters: Parameters, polygon: str) -> Iterator[Translation]:
    """Translate the parameters of a polygon with the `action_type` approach."""
    for nav2_name, simscen_name, offset in (
        ("time_before_collision", "time_before_collision", 0),
        ("simulation_time_step", "simulation_time_step", 0),
        ("max_points", "min_points", 1),  # Humble: the action starts at one point more
        ("min_points", "min_points", 0),
    ):
        value = parameters.get(f"{polygon}.{nav2_name}")
        if value is not None:
            value = value + offset if isinstance(value, int) and not isinstance(value, bool) else value
            yield Translation(f"{polygon}.{nav2_name}", ("collision_monitor", simscen_name), value)


def _xy_and_rotation(value: Any) -> list[float]:
    """Return a list of values for x, y, and rotation; [] if `value` is not a list of three numbers."""
    is_valid = isinstance(value, list) and len(value) == 3 and all(isinstance(item, int | float) for item in value)
    return value if is_valid else []


def _translate_amcl(parameters: Parameters) -> Iterator[Translation]:
    for name, value in parameters.items():
        if name == "robot_model_type":
            model = MOTION_MODELS.get(class_of(value))
            keys = ("localizer", "robot_model") if model else ()
            yield Translation(name, keys, model, "" if model else f"{value} is not supported")
        else:
            yield from translate_same_name(name, value, ("localizer",), "amcl")


def _translate_behavior_server(parameters: Parameters) -> Iterator[Translation]:
    for name, value in parameters.items():
        # A negative minimum has no effect in Nav2.
        has_no_minimum = name == "min_rotational_vel" and isinstance(value, float | int) and value < 0
        yield from translate_same_name(name, 0.0 if has_no_minimum else value, ("recovery",), "recovery")


TRANSLATORS: dict[str, Callable[[Parameters], Iterator[Translation]]] = {
    "amcl": _translate_amcl,
    "controller_server": translate_controller_server,
    "planner_server": translate_planner_server,
    "local_costmap": partial(translate_costmap, section="local_costmap"),
    "global_costmap": partial(translate_costmap, section="costmap"),
    "behavior_server": _translate_behavior_server,
    "velocity_smoother": _translate_velocity_smoother,
    "collision_monitor": _translate_collision_monitor,
}
"""Functions that translate the parameters of a node, by name of the node."""


def translate(node: str, parameters: Parameters) -> list[Translation]:
    """Return the translations of the relevant parameters of a node.

    The translation of a parameter without a counterpart in simscen has no keys.
    """
    translator = TRANSLATORS.get(OLD_NODE_NAMES.get(node, node))
    if translator is None:
        return []
    translations = list(translator(parameters))
    translated = {translation.parameter for translation in translations}
    covered = tuple(translation.covers for translation in translations if translation.covers)
    untranslated = [
        Translation(name, (), value, SCENARIO_PARAMETERS.get(name.partition(".")[0], ""))
        for name, value in parameters.items()
        if name not in translated and not name.startswith(covered) and _is_relevant(name, value)
    ]
    return [translation for translation in translations if translation.keys or translation.note] + untranslated


def is_unknown(node: str, parameters: Parameters) -> bool:
    """Return whether a node has relevant parameters, but no counterpart in simscen."""
    has_counterpart = OLD_NODE_NAMES.get(node, node) in TRANSLATORS or node in IGNORED_NODES
    return not has_counterpart and any(_is_relevant(name, value) for name, value in parameters.items())


def _is_relevant(parameter: str, value: object) -> bool:
    """Return whether a parameter with this value could change the behavior of the stack in simulation."""
    last = parameter.rpartition(".")[2]
    if last in IGNORED_PARAMETERS or any(part in last for part in IGNORED_NAME_PARTS):
        return False
    return last not in EQUIVALENT_VALUES or value not in EQUIVALENT_VALUES[last]
