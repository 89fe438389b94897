"""Translation of the parameters of Nav2's costmaps and of their layers to parameters of simscen's costmaps.

`parameters` are the parameters of a costmap in the Nav2 file. `section` is the key of the costmap under `stack`.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from simscen.loading.stacks.nav2_mapping import (
    Parameters,
    Translation,
    class_of,
    parameters_below,
    simscen_parameters,
    strings,
    translate_same_name,
)

DEFAULT_LAYERS = {"static_layer": "StaticLayer", "obstacle_layer": "ObstacleLayer", "inflation_layer": "InflationLayer"}
"""Classes of the layers of a costmap without `plugins`, by name of the layer."""
OBSERVATION_LAYERS = ("ObstacleLayer", "VoxelLayer")
"""Classes of layers that mark and clear obstacles by sensor data."""


def translate_costmap(parameters: Parameters, section: str) -> Iterator[Translation]:
    """Translate the parameters of the global or local costmap and of its layers."""
    layers: Mapping[str, str] = DEFAULT_LAYERS
    if isinstance(listed := parameters.get("plugins"), list):
        layers = {layer: class_of(parameters.get(f"{layer}.plugin", "")) for layer in strings(listed)}
        yield from _layer_notes(layers.values(), listed, section)
    handled = {*layers, *strings(parameters.get("filters"))}
    for name, value in parameters.items():
        layer, _, parameter = name.partition(".")
        if name == "rolling_window":
            is_rolling = section == "local_costmap"
            note = "the local costmap always rolls, the global costmap with `map: none`"
            yield Translation(name, (), value, "" if bool(value) == is_rolling else note)
        if not parameter:
            yield from translate_same_name(name, value, (section,), section)
        elif layers.get(layer) == "InflationLayer":
            yield from translate_same_name(name, value, (section,), section, name.rpartition(".")[2])
        elif layers.get(layer) == "DenoiseLayer":
            keys = (section, "denoise_layer")
            yield from translate_same_name(name, value, keys, "denoise_layer", name.rpartition(".")[2])
        elif layer not in handled:
            handled.add(layer)
            yield Translation(name, (), value, f"`plugins` does not list {layer}", covers=f"{layer}.")
    for layer, kind in layers.items():
        if kind == "DenoiseLayer" and f"{layer}.enabled" not in parameters:  # Nav2 enables layers by default
            yield Translation(f"{layer}.plugin", (section, "denoise_layer", "enabled"), True)
    yield from _translate_observation_sources(parameters, layers, section)
    for costmap_filter in strings(parameters.get("filters")):
        yield Translation("filters", (), None, covers=f"{costmap_filter}.")  # the scenario defines zones


def _layer_notes(kinds: Collection[str], listed: Any, section: str) -> Iterator[Translation]:
    """Yield notes about layers that only simscen's costmap has, or that only the Nav2 file lists.

    `kinds` are the classes of the layers in the Nav2 file, and `listed` is the value of `plugins`.
    """
    hint = "simscen always has this layer"
    if "InflationLayer" not in kinds:
        yield Translation("plugins", (), listed, "it lists no inflation layer", hint=hint)
    if not any(kind in OBSERVATION_LAYERS for kind in kinds):
        yield Translation("plugins", (), listed, "it lists no obstacle layer", hint=hint)
    if section == "local_costmap" and "StaticLayer" in kinds:
        yield Translation("plugins", (), listed, "the local costmap does not contain the map")


LASER_SCAN = "LaserScan"
"""Data type of laser scans, and of an observation source without `data_type`."""
HEIGHT_PARAMETERS = ("min_obstacle_height", "max_obstacle_height")
"""Parameters of observation sources that simscen applies only to camera data. All other parameters are ranges."""


def _translate_observation_sources(
    parameters: Parameters, layers: Mapping[str, str], section: str
) -> Iterator[Translation]:
    """Translate the ranges of the first laser scan, and the heights of the first point cloud.

    Without a point cloud, the heights of the first laser scan are used.
    """
    sources = _observation_sources(parameters, layers)
    types = {source: parameters.get(f"{source}.data_type", LASER_SCAN) for source in sources}
    first: dict[str, str] = {}
    for source in sorted(types, key=lambda source: types[source] == LASER_SCAN):  # point clouds first
        is_scan = types[source] == LASER_SCAN
        range_note = "" if is_scan else f"{types[source]} data does not set the ranges of the lidar"
        for key, value in parameters_below(parameters, source):
            name = f"{source}.{key}"
            if key not in simscen_parameters(section):
                continue
            if not is_scan and key not in HEIGHT_PARAMETERS:
                yield Translation(name, (), value, range_note, covers=f"{source}.")
                range_note = ""  # one note for all ranges of a source
            elif first.setdefault(key, source) == source:
                yield Translation(name, (section, key), value)
            else:
                differs = types[first[key]] == types[source] and parameters[f"{first[key]}.{key}"] != value
                note = f"only the value of the first source is used: {first[key]}" if differs else ""
                yield Translation(name, (), value, note)


def _observation_sources(parameters: Parameters, layers: Mapping[str, str]) -> Iterator[str]:
    """Yield the names `layer.source` of the observation sources of all layers."""
    for layer, kind in layers.items():
        if kind in OBSERVATION_LAYERS:
            found = [name.partition(".")[0] for name, _ in parameters_below(parameters, layer) if "." in name]
            listed = str(parameters.get(f"{layer}.observation_sources", " ".join(found))).split()
            yield from (f"{layer}.{source}" for source in listed)
