"""Work that the fork server does once before it forks the workers of a scenario."""

from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module

from pydantic import BaseModel

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.model.localizers import LocalizerSpec
from simscen.model.recovery import Recovery
from simscen.model.stack import StackSpec
from simscen.run.preparation import PreparedScenario
from simscen.sim.scene import walls
from simscen.spec.base import Component
from simscen.worlds.raycasting import ray_scene


def import_components(prepared: PreparedScenario) -> None:
    """Import the shipped components of the scenario's stacks and sensors."""
    for part in prepared.each.values():
        for module in shipped_modules(_components((part.stack, part.robot.sensors))):
            import_module(module)
        if isinstance(part.stack, StackSpec):
            import_module(part.stack.builder.partition(":")[0])
            if part.stack.filters_odometry(part.robot.has_imu):
                import_module("simscen.stack.odometry_filter")


def precompute(prepared: PreparedScenario) -> None:
    """Compute data structures of world and map that each run would otherwise compute itself."""
    from simscen.run.robot_interface import robot_model
    from simscen.stack.costmap import layered_costmap

    ray_scene.build_mesh_scene(prepared.built.mesh)
    walls.prepare_walls(prepared.built.mesh)
    for part in prepared.each.values():
        walls.prepare_walls(part.obstacles)
        if part.map is not None and isinstance(part.stack, StackSpec):
            grid = part.map.refined(part.stack.costmap.resolution)
            layered_costmap.precompute(part.stack.costmap, robot_model(part.body), grid)
            precompute_localizer(part.stack.localizer, grid)


def precompute_localizer(spec: LocalizerSpec, grid: OccupancyGrid) -> None:
    """Compute what a shipped localizer derives from its map, so that all runs share it."""
    module, _, name = spec.precomputation.partition(":")
    if module.startswith("simscen."):
        getattr(import_module(module), name)(spec, grid)


def shipped_modules(components: Iterable[Component]) -> Iterator[str]:
    """Yield the modules of the shipped components. Plug-ins are imported only in the worker process."""
    for component in components:
        module = component.component.partition(":")[0]
        if module.startswith("simscen."):
            yield module


def _components(value: object) -> Iterator[Component]:
    """Yield all component specifications in a specification."""
    if isinstance(value, Component):
        yield value
    inner: Iterable[object] = ()
    match value:
        case Recovery():  # which writes its behaviors as names
            inner = value.chosen()
        case BaseModel():
            inner = value.__dict__.values()
        case Mapping():
            inner = value.values()
        case list() | tuple():
            inner = value
    for one in inner:
        yield from _components(one)
