"""Translate the parameters of Nav2's controller and planner servers; the first plugin of each kind is used."""

from collections.abc import Iterator, Mapping
from typing import Any

from simscen.loading.nav2.mapping import (
    CONTROLLERS,
    DWB_CRITICS,
    DWB_CRITICS_WITHOUT_WEIGHT,
    MPPI_CRITICS,
    PLANNERS,
    RENAMED_PARAMETERS,
    Known,
    Parameters,
    Translation,
    class_of,
    parameters_below,
    strings,
    translate_same_name,
)


def controller_server(node: str, parameters: Parameters, known: Known) -> Iterator[Translation]:
    """Translate the parameters of checkers and of the controller."""
    for name in ("controller_frequency", "failure_tolerance"):
        if name in parameters:
            yield Translation(node, name, (name,), parameters[name])
    for kind, model in (("progress_checker", "progress_checker"), ("goal_checker", "simple")):
        chosen = _first_plugin(parameters, kind, kind)
        yield from _unused_plugins(node, parameters, kind, chosen)
        for key, value in parameters_below(parameters, chosen):
            yield from translate_same_name(node, f"{chosen}.{key}", value, (kind,), known[model], key)
    controller = _first_plugin(parameters, "controller", "FollowPath")
    yield from _unused_plugins(node, parameters, "controller", controller)
    yield from _plugin(node, parameters, controller, "controller", CONTROLLERS, known)


def planner_server(node: str, parameters: Parameters, known: Known) -> Iterator[Translation]:
    """Translate the parameters of the planner."""
    planner = _first_plugin(parameters, "planner", "GridBased")
    yield from _unused_plugins(node, parameters, "planner", planner)
    yield from _plugin(node, parameters, planner, "planner", PLANNERS, known)


def _first_plugin(parameters: Parameters, kind: str, default: str) -> str:
    """Return the name of the first plugin of a kind; before Iron the progress checker is not a list."""
    named = parameters.get(f"{kind}_plugins", parameters.get(f"{kind}_plugin", default))
    return next(iter(strings(named)), "") if isinstance(named, list) else str(named)


def _unused_plugins(node: str, parameters: Parameters, kind: str, chosen: str) -> Iterator[Translation]:
    listed = f"{kind}_plugins"
    for other in strings(parameters.get(listed))[1:]:
        yield Translation(node, listed, (), None, f"only the first {kind} is used: {chosen}, not {other}", f"{other}.")


def _plugin(
    node: str, parameters: Parameters, name: str, section: str, types: Mapping[str, str], known: Known
) -> Iterator[Translation]:
    """Translate type and parameters of a plugin; the primary controller of a rotation shim is used without the shim."""
    inner = f"{name}.primary_controller"
    shimmed = f"{inner}.plugin" in parameters
    plugin_key = f"{inner}.plugin" if shimmed else inner if inner in parameters else f"{name}.plugin"
    plugin = str(parameters.get(plugin_key, ""))
    kind = types.get(class_of(plugin))
    if kind is None:
        if plugin:
            why = f"{plugin} is not supported; the default {section} is used"
            yield Translation(node, plugin_key, (), plugin, why, covers=f"{name}.")
        return
    if plugin_key != f"{name}.plugin":
        shim = parameters.get(f"{name}.plugin")
        yield Translation(
            node, plugin_key, (section, "type"), kind, f"{shim} is not supported; {plugin} is used without it"
        )
    else:
        yield Translation(node, plugin_key, (section, "type"), kind)
    prefix = inner if shimmed else name
    model = _motion_model(parameters, prefix) if kind == "mppi" else ""
    for key, written in parameters_below(parameters, prefix):
        own, value = RENAMED_PARAMETERS.get((kind, key), key), written
        if key == "motion_model":
            value = model
        elif key.rpartition(".")[2] == "min_turning_r":
            own = key if model != "Ackermann" else "min_turning_r"
        elif key == "critics" and kind in ("mppi", "dwb"):
            yield from _critics(node, f"{prefix}.{key}", written, kind)
            continue
        yield from translate_same_name(node, f"{prefix}.{key}", value, (section,), known[kind], own)


def _motion_model(parameters: Parameters, prefix: str) -> str:
    """Return the motion model of MPPI; newer files refer to a plugin by name."""
    written = parameters.get(f"{prefix}.motion_model", "DiffDrive")
    return class_of(parameters.get(f"{prefix}.{written}.plugin", written)).removesuffix("MotionModel")


def _critics(node: str, name: str, written: Any, kind: str) -> Iterator[Translation]:
    """Translate the list of critics: a list for MPPI, and a weight of 0 for each DWB critic that is not listed."""
    listed = strings(written)
    supported = MPPI_CRITICS if kind == "mppi" else (*DWB_CRITICS, *DWB_CRITICS_WITHOUT_WEIGHT)
    names = {
        critic: class_of(critic).removesuffix("Critic") + ("Critic" if kind == "mppi" else "") for critic in listed
    }
    unknown = [critic for critic in listed if names[critic] not in supported]
    used = [names[critic] for critic in listed if names[critic] in supported]
    if kind == "mppi" and used:
        yield Translation(node, name, ("controller", "critics"), used)
    for critic, weight in DWB_CRITICS.items() if kind == "dwb" and listed else ():
        if critic not in used:
            yield Translation(node, name, ("controller", weight), 0.0)
    if unknown:
        yield Translation(node, name, (), written, f"not supported: {', '.join(unknown)}")
