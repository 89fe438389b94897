"""Translation of the parameters of Nav2's nodes to parameters of simscen's reference stack.

There is one function for each kind of node. `parameters` are the parameters of the node in the Nav2 file. `section` is
a key under `stack`, such as "controller".
"""

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

from simscen.loading.stacks.nav2_costmaps import translate_costmap
from simscen.loading.stacks.nav2_mapping import (
    CONTROLLERS,
    DWB_CRITICS,
    DWB_CRITICS_WITHOUT_WEIGHT,
    DWB_FORWARD_POINT_M,
    DWB_OPTIONAL_LIMITS,
    EQUIVALENT_VALUES,
    IGNORED_NAME_PARTS,
    IGNORED_NODES,
    IGNORED_PARAMETERS,
    MOTION_MODELS,
    MPPI_CRITICS,
    MPPI_OMNI_PARAMETERS,
    OLD_NODE_NAMES,
    PLANNERS,
    RENAMED_PARAMETERS,
    SCENARIO_PARAMETERS,
    Parameters,
    Translation,
    class_of,
    parameters_below,
    strings,
    translate_same_name,
)
from simscen.spec.quantities import MAX_DURATION_S

CONTROLLER_SERVER_PARAMETERS = (
    "controller_frequency", "failure_tolerance",
    "min_x_velocity_threshold", "min_y_velocity_threshold", "min_theta_velocity_threshold",
)  # fmt: skip
"""Parameters of the controller server itself, which have the same names under `stack`."""
POSE_PROGRESS_ANGLE_RAD = 0.5
"""Default of `required_movement_angle` of Nav2's PoseProgressChecker."""


def _translate_controller_server(parameters: Parameters) -> Iterator[Translation]:
    """Translate the parameters of the first progress checker, goal checker, and controller."""
    for name in CONTROLLER_SERVER_PARAMETERS:
        if name in parameters:
            yield Translation(name, (name,), parameters[name])
    for kind in ("progress_checker", "goal_checker"):
        chosen = _first_plugin(parameters, kind, kind)
        yield from _note_unused_plugins(parameters, kind, chosen)
        yield from _translate_checker_class(parameters, kind, chosen)
        for key, value in parameters_below(parameters, chosen):
            yield from translate_same_name(f"{chosen}.{key}", value, (kind,), kind, key)
    yield from _translate_plugin(parameters, "controller", "FollowPath", CONTROLLERS)


def _translate_checker_class(parameters: Parameters, kind: str, chosen: str) -> Iterator[Translation]:
    """Translate the class of the progress checker or goal checker `chosen`: its effect, or a note about another class.

    Yield nothing for the simple classes, whose parameters have the same names in simscen.
    """
    name = f"{chosen}.plugin"
    if name not in parameters:
        return
    match class_of(parameters[name]):
        case "SimpleProgressChecker" | "SimpleGoalChecker":
            pass
        case "PoseProgressChecker":
            if f"{chosen}.required_movement_angle" not in parameters:
                yield Translation(name, (kind, "required_movement_angle"), POSE_PROGRESS_ANGLE_RAD)
        case "PositionGoalChecker":
            yield Translation(name, (kind, "yaw_goal_tolerance"), math.pi)
        case other:
            yield Translation(name, (), other, f"{other} is not supported; the simple {kind} is used")


def _first_plugin(parameters: Parameters, kind: str, default: str) -> str:
    """Return the name of the first plugin of a kind such as "planner"; `default` if the file lists none."""
    # Before Iron, the progress checker is a single name instead of a list.
    named = parameters.get(f"{kind}_plugins", parameters.get(f"{kind}_plugin", default))
    return next(iter(strings(named)), "") if isinstance(named, list) else str(named)


def _note_unused_plugins(parameters: Parameters, kind: str, chosen: str) -> Iterator[Translation]:
    """Yield a note for each plugin of a kind that is not used. Only the first one, `chosen`, is used."""
    listed = f"{kind}_plugins"
    for other in strings(parameters.get(listed))[1:]:
        yield Translation(listed, (), None, f"only the first {kind} is used: {chosen}, not {other}", f"{other}.")


def _translate_plugin(
    parameters: Parameters, section: str, default: str, types: Mapping[str, str]
) -> Iterator[Translation]:
    """Translate the type and the parameters of the first controller or planner (`section`).

    For a rotation shim controller, only its primary controller is translated. `default` is the name of the plugin
    if the file lists none. `types` are the types in simscen, by class in Nav2.
    """
    name = _first_plugin(parameters, section, default)
    yield from _note_unused_plugins(parameters, section, name)
    inner = f"{name}.primary_controller"
    shimmed = f"{inner}.plugin" in parameters
    plugin_key = f"{inner}.plugin" if shimmed else inner if inner in parameters else f"{name}.plugin"
    plugin = str(parameters.get(plugin_key, ""))
    kind = types.get(class_of(plugin))
    if kind is None:
        if plugin:
            why = f"{plugin} is not supported; the default {section} is used"
            yield Translation(plugin_key, (), plugin, why, covers=f"{name}.")
        return
    why = ""
    if plugin_key != f"{name}.plugin":
        why = f"{parameters.get(f'{name}.plugin')} is not supported; {plugin} is used without it"
    yield Translation(plugin_key, (section, "type"), kind, why)
    prefix = inner if shimmed else name
    model = _motion_model(parameters, prefix) if kind == "mppi" else ""
    for key, written in parameters_below(parameters, prefix):
        own, value = RENAMED_PARAMETERS.get((kind, key), key), written
        if key == "motion_model":
            value = model
        elif (kind, key) == ("dwb", "GoalAlign.forward_point_distance"):
            is_same = written == parameters.get(f"{prefix}.PathAlign.forward_point_distance", DWB_FORWARD_POINT_M)
            why = "" if is_same else "simscen uses the value of PathAlign"
            yield Translation(f"{prefix}.{key}", (), written, why)
            continue
        elif key.rpartition(".")[2] == "min_turning_r":
            own = key if model != "Ackermann" else "min_turning_r"
        elif key == "critics" and kind in ("mppi", "dwb"):
            yield from _translate_critics(f"{prefix}.{key}", written, kind)
            continue
        elif _has_no_effect(kind, model, key, written):
            yield Translation(f"{prefix}.{key}", (), written)
            continue
        yield from translate_same_name(f"{prefix}.{key}", value, (section,), kind, own)


def _has_no_effect(kind: str, model: str, name: str, value: Any) -> bool:
    """Return whether Nav2 ignores a value, which simscen would reject as out of range. `model` is that of MPPI."""
    if not isinstance(value, float | int):
        return False
    if kind == "dwb":
        return name in DWB_OPTIONAL_LIMITS and value < 0
    return kind == "mppi" and model != "Omni" and name in MPPI_OMNI_PARAMETERS and value == 0


def _motion_model(parameters: Parameters, prefix: str) -> str:
    """Return the motion model of MPPI, such as "DiffDrive". `prefix` is the key of the controller."""
    written = parameters.get(f"{prefix}.motion_model", "DiffDrive")
    return class_of(parameters.get(f"{prefix}.{written}.plugin", written)).removesuffix("MotionModel")


def _translate_critics(name: str, written: Any, kind: str) -> Iterator[Translation]:
    """Translate the list `written` of critics: MPPI gets the supported ones, DWB the weight 0 for all others."""
    listed = strings(written)
    supported = MPPI_CRITICS if kind == "mppi" else (*DWB_CRITICS, *DWB_CRITICS_WITHOUT_WEIGHT)
    suffix = "Critic" if kind == "mppi" else ""
    names = {critic: class_of(critic).removesuffix("Critic") + suffix for critic in listed}
    unknown = [critic for critic in listed if names[critic] not in supported]
    used = [names[critic] for critic in listed if names[critic] in supported]
    if kind == "mppi" and used:
        yield Translation(name, ("controller", "critics"), used)
    for critic, weight in DWB_CRITICS.items() if kind == "dwb" and listed else ():
        if critic not in used:
            yield Translation(name, ("controller", weight), 0.0)
    if unknown:
        yield Translation(name, (), written, f"not supported: {', '.join(unknown)}")


def _translate_velocity_smoother(parameters: Parameters) -> Iterator[Translation]:
    """Translate the limits of forward motion and turning. Other limits get a note if they differ."""
    turning_names = {"max_velocity": "max_angular_velocity", "max_accel": "max_angular_accel", "max_decel": ""}
    for name, turning in turning_names.items():
        limits = _xy_and_rotation(parameters.get(name))
        for simscen_name, limit in zip((name, turning), limits[::2], strict=True) if limits else ():
            if simscen_name and limit:
                yield Translation(name, ("velocity_smoother", simscen_name), abs(limit))
        if limits and limits[1] and abs(limits[1]) != abs(limits[0]):
            yield Translation(name, (), limits, "lateral motion has the same limit as forward motion")
    lowest, highest = _xy_and_rotation(parameters.get("min_velocity")), _xy_and_rotation(parameters.get("max_velocity"))
    if lowest:
        is_same = bool(highest) and all(low in (-high, 0) for low, high in zip(lowest, highest, strict=True))
        why = "" if is_same else "backward motion has the same limit as forward motion"
        yield Translation("min_velocity", (), lowest, why)
    faster, slower = _xy_and_rotation(parameters.get("max_accel")), _xy_and_rotation(parameters.get("max_decel"))
    if faster and slower and abs(slower[2]) != abs(faster[2]):
        why = "angular deceleration has the same limit as angular acceleration"
        yield Translation("max_decel", (), slower, why)


def _translate_collision_monitor(parameters: Parameters) -> Iterator[Translation]:
    """Translate the first enabled `approach` polygon. Other enabled polygons get a note."""
    timeout = parameters.get("source_timeout")
    if timeout is not None:
        is_off = timeout == 0 and not isinstance(timeout, bool)
        timeout = MAX_DURATION_S if is_off else timeout
        yield Translation("source_timeout", ("collision_monitor", "source_timeout"), timeout)
    on = parameters.get("enabled", True)
    actions = {polygon: parameters.get(f"{polygon}.action_type") for polygon in strings(parameters.get("polygons"))}
    enabled = {polygon: parameters.get(f"{polygon}.enabled", True) for polygon in actions}
    approaching = {polygon: enabled[polygon] for polygon in actions if actions[polygon] == "approach"}
    used = max(approaching, key=lambda polygon: bool(approaching[polygon]), default="")  # the first enabled one, if any
    for polygon, action in actions.items():
        if polygon == used:
            yield from (Translation(f"{polygon}.{setting}", (), None) for setting in ("action_type", "enabled"))
            yield from _translate_approach(parameters, polygon)
        elif enabled[polygon]:
            why = f"action_type {action} of {polygon} is not supported"
            if polygon in approaching:
                why = f"only the first polygon that approaches is used: {used}, not {polygon}"
            yield Translation("polygons", (), action, why, covers=f"{polygon}.")
        else:
            yield Translation("polygons", (), action, covers=f"{polygon}.")  # disabled
    on = on and (any(approaching.values()) or not approaching)
    for name in ("enabled", "polygons"):
        if name in parameters:
            yield Translation(name, ("collision_monitor", "enabled"), on)
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
    fits = isinstance(value, list) and len(value) == 3 and all(isinstance(one, int | float) for one in value)
    return value if fits else []


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
        no_minimum = name == "min_rotational_vel" and isinstance(value, float | int) and value < 0
        yield from translate_same_name(name, 0.0 if no_minimum else value, ("recovery",), "recovery")


TRANSLATORS: dict[str, Callable[[Parameters], Iterator[Translation]]] = {
    "amcl": _translate_amcl,
    "controller_server": _translate_controller_server,
    "planner_server": partial(_translate_plugin, section="planner", default="GridBased", types=PLANNERS),
    "local_costmap": partial(translate_costmap, section="local_costmap"),
    "global_costmap": partial(translate_costmap, section="costmap"),
    "behavior_server": _translate_behavior_server,
    "velocity_smoother": _translate_velocity_smoother,
    "collision_monitor": _translate_collision_monitor,
}
"""Functions that translate the parameters of a node, by name of the node."""


def translate(node: str, parameters: Parameters) -> list[Translation]:
    """Return the translations of the relevant parameters of a node, without keys if simscen has no counterpart."""
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
