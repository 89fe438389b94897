"""Nav2's costmaps: parameters of their own, and of the layers that they name."""

from collections.abc import Iterator, Mapping, Sequence

from simscen.loading.nav2found import Found, Known, Parameters, same, strings
from simscen.loading.nav2names import class_of

USUAL_LAYERS = {
    "static_layer": "StaticLayer",
    "obstacle_layer": "ObstacleLayer",
    "inflation_layer": "InflationLayer",
}
"""Those of a costmap whose file names none."""
SEEING = ("ObstacleLayer", "VoxelLayer")


def costmap(node: str, parameters: Parameters, known: Known) -> Iterator[Found]:
    """The global costmap, or the local one."""
    section = "local_costmap" if node == "local_costmap" else "costmap"
    layers = _layers(parameters)
    besides = {*layers, *strings(parameters.get("filters"))}
    for name, value in parameters.items():
        layer, _, rest = name.partition(".")
        if not rest:
            yield from _own(node, name, value, section, known[section])
        elif layer in layers:
            yield from _of_layer(node, name, parameters, layers, section, known)
        elif layer not in besides:
            besides.add(layer)
            yield Found(node, name, (), value, f"`plugins` does not name {layer}", covers=f"{layer}.")
    for zones in strings(parameters.get("filters")):
        yield Found(node, "filters", (), None, covers=f"{zones}.")  # zones are the scenario's


def _layers(parameters: Parameters) -> Mapping[str, str]:
    if not isinstance(parameters.get("plugins"), list):
        return USUAL_LAYERS
    return {layer: class_of(parameters.get(f"{layer}.plugin", "")) for layer in strings(parameters["plugins"])}


def _own(node: str, name: str, value: object, section: str, known: Sequence[str]) -> Iterator[Found]:
    if name == "rolling_window":
        rolls = section == "local_costmap"
        why = "" if bool(value) == rolls else "the local costmap always rolls, the global one with `map: none`"
        yield Found(node, name, (), value, why)
    yield from same(node, name, value, (section,), known)


def _of_layer(
    node: str, name: str, parameters: Parameters, layers: Mapping[str, str], section: str, known: Known
) -> Iterator[Found]:
    layer, _, rest = name.partition(".")
    value, kind, (source, _, last) = parameters[name], layers[layer], rest.rpartition(".")
    sources = str(parameters.get(f"{layer}.observation_sources", source)).split()
    if kind == "InflationLayer" or (kind in SEEING and source and source in sources):
        yield from same(node, name, value, (section,), known[section], last)
    elif kind == "DenoiseLayer":
        yield from same(node, name, value, (section, "denoise_layer"), known["denoise_layer"], last)
