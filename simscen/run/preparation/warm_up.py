"""What the runs of a scenario are built of is imported and worked out once, rather than in each of their processes."""

from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module

from pydantic import BaseModel

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.model.localizers import LocalizerSpec
from simscen.model.recovery import Recovery
from simscen.model.stack import StackSpec
from simscen.run.preparation.scenario import PreparedScenario
from simscen.sim import walls
from simscen.spec.component import Component
from simscen.worlds import rays


def import_components(prepared: PreparedScenario) -> None:
    """Import the components of its stacks and sensors that simscen ships."""
    for part in prepared.each.values():
        for module in shipped_modules(_components((part.stack, part.robot.sensors))):
            import_module(module)


def precompute(prepared: PreparedScenario) -> None:
    """What each of its runs would need of the world and of the map: 0.6 s for a map of 100 x 100 m."""
    from simscen.run.robot_interface import robot_model
    from simscen.stack.costmap import costmap

    rays.ready(prepared.built.mesh)
    walls.ready(prepared.built.mesh)
    for part in prepared.each.values():
        walls.ready(part.obstacles)
        if part.map is not None and isinstance(part.stack, StackSpec):
            grid = part.map.refined(part.stack.costmap.resolution)
            costmap.ready(part.stack.costmap, robot_model(part.body), grid)
            precompute_localizer(part.stack.localizer, grid)


def precompute_localizer(spec: LocalizerSpec, grid: OccupancyGrid) -> None:
    """Compute what a shipped localizer derives from its map, so that all runs share it."""
    module, _, name = spec.precomputation.partition(":")
    if module.startswith("simscen."):
        getattr(import_module(module), name)(spec, grid)


def shipped_modules(components: Iterable[Component]) -> Iterator[str]:
    """Where those that simscen ships are; those of packages are only ever imported in the process of a run."""
    for component in components:
        module = component.component.partition(":")[0]
        if module.startswith("simscen."):
            yield module


def _components(value: object) -> Iterator[Component]:
    """All specifications of components in a specification."""
    if isinstance(value, Component):
        yield value
    inner: Iterable[object] = ()
    match value:
        case Recovery():  # which writes its behaviours as names
            inner = value.chosen()
        case BaseModel():
            inner = value.__dict__.values()
        case Mapping():
            inner = value.values()
        case list() | tuple():
            inner = value
    for one in inner:
        yield from _components(one)
