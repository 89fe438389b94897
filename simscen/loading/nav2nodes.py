"""Which parameters of Nav2's nodes are parameters of the reference stack, too, and where they stand there."""

from collections.abc import Iterator, Mapping

from simscen.loading.nav2costmaps import costmap
from simscen.loading.nav2found import Found, Known, Parameters, same
from simscen.loading.nav2guards import collision_monitor, velocity_smoother
from simscen.loading.nav2names import (
    AS_HERE,
    CALLED_BEFORE,
    MOTION_MODELS,
    NOTHING_HERE,
    OF_THE_SCENARIO,
    PARTS_OF_NOTHING_HERE,
    WITHOUT,
    class_of,
)
from simscen.loading.nav2plugins import controller_server, planner_server


def found(nodes: Mapping[str, Parameters], known: Known) -> Iterator[Found]:
    """What becomes of each parameter. `known` are our parameters by section, or by type of what is in it."""
    for node, parameters in nodes.items():
        reader = NODES.get(CALLED_BEFORE.get(node, node))
        if reader is None:
            continue
        taken = list(reader(node, parameters, known))
        yield from (one for one in taken if one.path or one.why)
        told = {one.parameter for one in taken}
        covered = tuple(one.covers for one in taken if one.covers)
        for name, value in parameters.items():
            if name not in told and not name.startswith(covered) and _matters(name, value):
                yield Found(node, name, (), value, OF_THE_SCENARIO.get(name.partition(".")[0], ""))


def strangers(nodes: Mapping[str, Parameters]) -> list[str]:
    """The nodes that nothing here is like, and that say something that matters."""
    return [
        node
        for node, parameters in nodes.items()
        if CALLED_BEFORE.get(node, node) not in NODES
        and node not in WITHOUT
        and any(_matters(name, value) for name, value in parameters.items())
    ]


def _matters(parameter: str, value: object) -> bool:
    last = parameter.rpartition(".")[2]
    if last in NOTHING_HERE or any(part in last for part in PARTS_OF_NOTHING_HERE):
        return False
    return last not in AS_HERE or value not in AS_HERE[last]


def _amcl(node: str, parameters: Parameters, known: Known) -> Iterator[Found]:
    for name, value in parameters.items():
        if name == "robot_model_type":
            model = MOTION_MODELS.get(class_of(value))
            path = ("localizer", "robot_model") if model else ()
            yield Found(node, name, path, model, "" if model else f"there is no {value} here")
        else:
            yield from same(node, name, value, ("localizer",), known["amcl"])


def _behavior_server(node: str, parameters: Parameters, known: Known) -> Iterator[Found]:
    for name, value in parameters.items():
        yield from same(node, name, value, ("recovery",), known["recovery"])


NODES = {
    "amcl": _amcl,
    "controller_server": controller_server,
    "planner_server": planner_server,
    "local_costmap": costmap,
    "global_costmap": costmap,
    "behavior_server": _behavior_server,
    "velocity_smoother": velocity_smoother,
    "collision_monitor": collision_monitor,
}
