"""Which parameters of Nav2's nodes are parameters of the reference stack, too, and where they stand there."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from simscen.loading.nav2names import CONTROLLERS, MOTION_MODELS, NOTHING_HERE, PLANNERS, SAID_OTHERWISE, WITHOUT

Path = tuple[str, ...]
"""Keys below `stack:`."""
Parameters = Mapping[str, Any]
"""`obstacle_layer.scan.topic` → value, of one node."""
Known = Mapping[str, Sequence[str]]
"""Our parameters by section, or by the type of what is in it; `a.b` is `b` in the mapping `a`."""


@dataclass(frozen=True)
class Found:
    """A parameter of Nav2, and where it belongs in a stack; `path` is empty for one that means nothing here.

    `why` tells more of it, where there is more to tell.
    """

    node: str
    parameter: str
    path: Path
    value: Any
    why: str = ""


def found(nodes: Mapping[str, Parameters], known: Known) -> Iterator[Found]:
    """What becomes of each parameter. `known` are our parameters by section, or by type of what is in it."""
    for node, parameters in nodes.items():
        for one in NODES[node](node, parameters, known) if node in NODES else ():
            if one.path or one.why or not _of_no_matter(one.parameter):
                yield one


def strangers(nodes: Mapping[str, Parameters]) -> list[str]:
    """The nodes that nothing here is like."""
    return [node for node in nodes if node not in NODES and node not in WITHOUT]


def _of_no_matter(parameter: str) -> bool:
    return any(part in parameter.rsplit(".", maxsplit=1)[-1] for part in NOTHING_HERE)


def _amcl(node: str, parameters: Parameters, known: Known) -> Iterator[Found]:
    for name, value in parameters.items():
        if name == "robot_model_type":
            model = MOTION_MODELS.get(_class(value))
            path = ("localizer", "robot_model") if model else ()
            yield Found(node, name, path, model, "" if model else f"there is no {value} here")
        else:
            yield _same(node, name, value, ("localizer",), known["amcl"])


def _controller_server(node: str, parameters: Parameters, known: Known) -> Iterator[Found]:
    for name in ("controller_frequency", "failure_tolerance"):
        if name in parameters:
            yield Found(node, name, (name,), parameters[name])
    progress, goal, driver = (
        _first(parameters, f"{kind}_plugins") for kind in ("progress_checker", "goal_checker", "controller")
    )
    yield from _part(node, parameters, progress, ("progress_checker",), known["progress_checker"])
    yield from _part(node, parameters, goal, ("goal_checker",), known["simple"])
    yield from _plugin(node, parameters, driver, "controller", CONTROLLERS, known)


def _planner_server(node: str, parameters: Parameters, known: Known) -> Iterator[Found]:
    yield from _plugin(node, parameters, _first(parameters, "planner_plugins"), "planner", PLANNERS, known)


def _plugin(
    node: str,
    parameters: Parameters,
    name: str,
    section: str,
    types: Mapping[str, str],
    known: Known,
) -> Iterator[Found]:
    """The first plug-in of a server: what it is, then its parameters."""
    plugin = str(parameters.get(f"{name}.primary_controller", parameters.get(f"{name}.plugin", "")))
    kind = types.get(_class(plugin))
    if kind is None:
        if plugin:
            yield Found(node, f"{name}.plugin", (), plugin, f"there is no {plugin} here: the usual one is used")
        return
    if f"{name}.primary_controller" in parameters:
        shim = parameters.get(f"{name}.plugin")
        yield Found(node, f"{name}.primary_controller", (), plugin, f"there is no {shim} here; {plugin} drives alone")
    yield Found(node, f"{name}.plugin", (section, "type"), kind)
    for key, written in _below(parameters, name):
        own, value = SAID_OTHERWISE.get((kind, key), key), written
        if key == "motion_model":  # MPPI's, by the name under which its plug-in stands
            value = _class(parameters.get(f"{name}.{written}.plugin", written)).removesuffix("MotionModel")
        if key not in ("plugin", "primary_controller"):
            yield _same(node, f"{name}.{key}", value, (section,), known[kind], own)


def _costmap(node: str, parameters: Parameters, known: Known) -> Iterator[Found]:
    section = "local_costmap" if node == "local_costmap" else "costmap"
    layers = {str(layer): _class(parameters.get(f"{layer}.plugin", "")) for layer in parameters.get("plugins") or ()}
    for name, value in parameters.items():
        layer, _, rest = name.partition(".")
        kind, last = layers.get(layer, ""), rest.rpartition(".")[2]
        if not rest:
            yield _same(node, name, value, (section,), known[section])
        elif kind == "InflationLayer" or (kind in ("ObstacleLayer", "VoxelLayer") and "." in rest):
            yield _same(node, name, value, (section,), known[section], last)
        elif kind == "DenoiseLayer":
            yield _same(node, name, value, (section, "denoise_layer"), known["denoise_layer"], last)
        elif kind not in ("StaticLayer",) and layer in layers:
            yield Found(node, name, (), value)


def _behavior_server(node: str, parameters: Parameters, known: Known) -> Iterator[Found]:
    for name, value in parameters.items():
        if "." not in name:
            yield _same(node, name, value, ("recovery",), known["recovery"])


def _velocity_smoother(node: str, parameters: Parameters, _: Known) -> Iterator[Found]:
    paired = {"max_velocity": "max_angular_velocity", "max_accel": "max_angular_accel", "max_decel": ""}
    for name, value in parameters.items():
        if name in paired and isinstance(value, list) and len(value) == 3:
            for ours, part in ((name, value[0]), (paired[name], value[2])):
                if ours and part:
                    yield Found(node, name, ("velocity_smoother", ours), abs(part))
        elif name not in ("min_velocity", "deadband_velocity") or any(value or ()):
            yield Found(node, name, (), value)


def _collision_monitor(node: str, parameters: Parameters, _: Known) -> Iterator[Found]:
    for name in ("enabled", "source_timeout"):
        if name in parameters:
            yield Found(node, name, ("collision_monitor", name), parameters[name])
    for polygon in parameters.get("polygons") or ():
        action = parameters.get(f"{polygon}.action_type")
        if action != "approach":
            yield Found(node, f"{polygon}.action_type", (), action, f"there is no polygon that does {action} here")
            continue
        for name in ("time_before_collision", "min_points"):
            if f"{polygon}.{name}" in parameters:
                yield Found(node, f"{polygon}.{name}", ("collision_monitor", name), parameters[f"{polygon}.{name}"])


def _part(node: str, parameters: Parameters, name: str, section: Path, known: Sequence[str]) -> Iterator[Found]:
    for key, value in _below(parameters, name):
        yield _same(node, f"{name}.{key}", value, section, known, key)


def _same(node: str, name: str, value: Any, section: Path, known: Sequence[str], own: str = "") -> Found:
    """A parameter that is called here as there, where there is one; `a.b` is `b` in the mapping `a`."""
    path = tuple((own or name).split("."))
    there = ".".join(path) in known
    return Found(node, name, (*section, *path) if there else (), value)


def _below(parameters: Parameters, name: str) -> Iterator[tuple[str, Any]]:
    for key, value in parameters.items():
        if name and key.startswith(f"{name}."):
            yield key.removeprefix(f"{name}."), value


def _first(parameters: Parameters, name: str) -> str:
    plugins = parameters.get(name)
    return str(plugins[0]) if isinstance(plugins, list) and plugins else ""


def _class(plugin: object) -> str:
    """`nav2_navfn_planner::NavfnPlanner` and `nav2_navfn_planner/NavfnPlanner` → NavfnPlanner."""
    return str(plugin).replace("/", "::").rpartition("::")[2]


NODES = {
    "amcl": _amcl,
    "controller_server": _controller_server,
    "planner_server": _planner_server,
    "local_costmap": _costmap,
    "global_costmap": _costmap,
    "behavior_server": _behavior_server,
    "velocity_smoother": _velocity_smoother,
    "collision_monitor": _collision_monitor,
}
