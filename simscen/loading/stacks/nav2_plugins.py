"""Translates the plug-ins of Nav2's controller and planner servers to parameters of simscen's reference stack.

`parameters` are the parameters of the server in the Nav2 file. `section` is a key under `stack`, such as "controller".
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from simscen.loading.stacks.nav2_mapping import (
    CONTROLLERS,
    DWB_CRITICS,
    DWB_CRITICS_WITHOUT_WEIGHT,
    DWB_FORWARD_POINT_M,
    DWB_OPTIONAL_LIMITS,
    MPPI_CRITICS,
    MPPI_OMNI_PARAMETERS,
    PLANNERS,
    RENAMED_PARAMETERS,
    Parameters,
    Translation,
    class_of,
    parameters_below,
    strings,
    translate_same_name,
)

CONTROLLER_SERVER_PARAMETERS = (
    "controller_frequency", "failure_tolerance",
    "min_x_velocity_threshold", "min_y_velocity_threshold", "min_theta_velocity_threshold",
)  # fmt: skip
"""Parameters of the controller server itself, which have the same names under `stack`."""
POSE_PROGRESS_ANGLE_RAD = 0.5
"""Default of `required_movement_angle` of Nav2's PoseProgressChecker."""


def translate_controller_server(parameters: Parameters) -> Iterator[Translation]:
    """Translate the parameters of the first progress checker, goal checker, and controller."""
    for name in CONTROLLER_SERVER_PARAMETERS:
        if name in parameters:
            yield Translation(name, (name,), parameters[name])
    for kind in ("progress_checker", "goal_checker"):
        chosen = _first_plugin(parameters, kind, kind)
        yield from _unused_plugin_notes(parameters, kind, chosen)
        yield from _translate_checker_class(parameters, kind, chosen)
        for key, value in parameters_below(parameters, chosen):
            yield from translate_same_name(f"{chosen}.{key}", value, (kind,), kind, key)
    yield from _translate_plugin(parameters, "controller", "FollowPath", CONTROLLERS)


def translate_planner_server(parameters: Parameters) -> Iterator[Translation]:
    """Translate the parameters of the first planner."""
    yield from _translate_plugin(parameters, "planner", "GridBased", PLANNERS)


def _translate_checker_class(parameters: Parameters, kind: str, chosen: str) -> Iterator[Translation]:
    """Translate the class of the progress checker or goal checker with the name `chosen`.

    Yields a note if simscen does not have the class. The simple classes need no translation, because their
    parameters have the same names in simscen.
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


def _unused_plugin_notes(parameters: Parameters, kind: str, chosen: str) -> Iterator[Translation]:
    """Yield a note for each plugin of a kind that is not used. Only the first plugin, `chosen`, is used."""
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
    yield from _unused_plugin_notes(parameters, section, name)
    inner = f"{name}.primary_controller"
    has_shim_prefix = f"{inner}.plugin" in parameters
    plugin_key = f"{inner}.plugin" if has_shim_prefix else inner if inner in parameters else f"{name}.plugin"
    plugin = str(parameters.get(plugin_key, ""))
    kind = types.get(class_of(plugin))
    if kind is None:
        if plugin:
            note = f"{plugin} is not supported; the default {section} is used"
            yield Translation(plugin_key, (), plugin, note, covers=f"{name}.")
        return
    note = ""
    if plugin_key != f"{name}.plugin":
        note = f"{parameters.get(f'{name}.plugin')} is not supported; {plugin} is used without it"
    yield Translation(plugin_key, (section, "type"), kind, note)
    prefix = inner if has_shim_prefix else name
    model = _motion_model(parameters, prefix) if kind == "mppi" else ""
    for key, nav2_value in parameters_below(parameters, prefix):
        simscen_name, value = RENAMED_PARAMETERS.get((kind, key), key), nav2_value
        if key == "motion_model":
            value = model
        elif (kind, key) == ("dwb", "GoalAlign.forward_point_distance"):
            is_same = nav2_value == parameters.get(f"{prefix}.PathAlign.forward_point_distance", DWB_FORWARD_POINT_M)
            note = "" if is_same else "simscen uses the value of PathAlign"
            yield Translation(f"{prefix}.{key}", (), nav2_value, note)
            continue
        elif key.rpartition(".")[2] == "min_turning_r":
            simscen_name = key if model != "Ackermann" else "min_turning_r"
        elif key == "critics" and kind in ("mppi", "dwb"):
            yield from _translate_critics(f"{prefix}.{key}", nav2_value, kind)
            continue
        elif _has_no_effect(kind, model, key, nav2_value):
            yield Translation(f"{prefix}.{key}", (), nav2_value)
            continue
        yield from translate_same_name(f"{prefix}.{key}", value, (section,), kind, simscen_name)


def _has_no_effect(kind: str, model: str, name: str, value: Any) -> bool:
    """Return whether Nav2 ignores a value that simscen would reject as out of range.

    `kind` is the type of the controller, and `model` the motion model of MPPI.
    """
    if not isinstance(value, float | int):
        return False
    if kind == "dwb":
        return name in DWB_OPTIONAL_LIMITS and value < 0
    return kind == "mppi" and model != "Omni" and name in MPPI_OMNI_PARAMETERS and value == 0


def _motion_model(parameters: Parameters, prefix: str) -> str:
    """Return the motion model of MPPI, such as "DiffDrive". `prefix` is the key of the controller."""
    written = parameters.get(f"{prefix}.motion_model", "DiffDrive")
    return class_of(parameters.get(f"{prefix}.{written}.plugin", written)).removesuffix("MotionModel")


def _translate_critics(name: str, value: Any, kind: str) -> Iterator[Translation]:
    """Translate the list of critics. MPPI gets the supported critics. DWB gets the weight 0 for critics not listed."""
    listed = strings(value)
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
        yield Translation(name, (), value, f"not supported: {', '.join(unknown)}")
