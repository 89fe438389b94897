"""Main module of the fork server, which prepares scenarios and forks a worker for each run.

The command starts the server as `python -I -m simscen.cli.session.fork_server_main FD`, where FD is the file
descriptor for replies.
"""

import gc

gc.disable()  # until the modules are imported, to start fast (docs/design/startup.md)

import os
import resource
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from PIL import Image
from pydantic import BaseModel

import simscen.sim.simulation
import simscen.stack.build  # noqa: F401 - engines are imported here so that the forks need not
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.records.case import Run
from simscen.model.localizers import LocalizerSpec
from simscen.model.recovery import Recovery
from simscen.model.stack import StackSpec
from simscen.record.log_reader import read_run
from simscen.report.picture.map_picture import write_picture
from simscen.report.picture.scene import Scene, scene_with_robots
from simscen.run.disk_cache import DiskCache, cache_folder
from simscen.run.log_header import log_header, world_scenery
from simscen.run.preparation import PreparedScenario
from simscen.run.process.fork_server import ForkServer
from simscen.run.process.isolation import MAX_MEMORY_BYTES
from simscen.run.process.jobs import Job
from simscen.run.process.worker import ProgressReporter
from simscen.run.run_files import execute_run
from simscen.run.scenario_cache import CachedWorldBuilder, ScenarioCache
from simscen.sim.bullet.client_pool import CLIENT_POOL
from simscen.sim.scene import walls
from simscen.spec.base import Component
from simscen.worlds.raycasting.mesh_scene import cached_mesh_scene

gc.freeze()  # imported modules live until the end, so the garbage collector need not scan them
gc.enable()


def import_components(prepared: PreparedScenario) -> None:
    """Import the shipped components of the scenario's stacks and sensors, so that all workers share them."""
    for part in prepared.by_robot.values():
        for module in shipped_modules(_components((part.stack, part.robot.sensors))):
            import_module(module)
        if isinstance(part.stack, StackSpec):
            import_module(part.stack.builder.partition(":")[0])
            if part.stack.filters_odometry(part.robot.has_imu):
                import_module("simscen.stack.localizers.odometry_filter")


def precompute(prepared: PreparedScenario) -> None:
    """Compute the data structures of world and map, such as ray trees and costmaps, so that all workers share them."""
    from simscen.run.robot_interface import robot_model
    from simscen.stack.costmap import layered_costmap

    cached_mesh_scene(prepared.built.mesh)
    walls.prepare_walls(prepared.built.mesh)
    for part in prepared.by_robot.values():
        walls.prepare_walls(part.obstacles)
        if part.map is not None and isinstance(part.stack, StackSpec):
            grid = part.map.refined(part.stack.costmap.resolution)
            layered_costmap.precompute(part.stack.costmap, robot_model(part.body), grid)
            precompute_localizer(part.stack.localizer, grid)


def precompute_localizer(spec: LocalizerSpec, grid: OccupancyGrid) -> None:
    """Compute the data that a shipped localizer derives from its map, such as a likelihood field."""
    module, _, name = spec.precomputation.partition(":")
    if module.startswith("simscen."):
        getattr(import_module(module), name)(spec, grid)


def shipped_modules(components: Iterable[Component]) -> Iterator[str]:
    """Yield the module of each component that is part of simscen."""
    for component in components:
        module = component.component.partition(":")[0]
        if module.startswith("simscen."):
            yield module


def _components(value: object) -> Iterator[Component]:
    """Yield the specifications of all components in a specification, including nested ones."""
    if isinstance(value, Component):
        yield value
    inner: Iterable[object] = ()
    match value:
        case Recovery():  # its fields contain only the names of its behaviors
            inner = value.behavior_specs()
        case BaseModel():
            inner = value.__dict__.values()
        case Mapping():
            inner = value.values()
        case list() | tuple():
            inner = value
    for item in inner:
        yield from _components(item)


_SCENARIO_CACHE = ScenarioCache(CachedWorldBuilder(DiskCache(cache_folder(os.environ))))
Image.preinit()  # imports now instead of in every fork that writes a picture


def main() -> None:
    """Process the requests of the supervisor until it closes the connection."""
    ForkServer(0, int(sys.argv[1]), _warm_up, _execute).serve()
    os._exit(0)  # skips the teardown of the interpreter, for which the supervisor would wait


def _warm_up(job: Job) -> None:
    """Prepare the scenario of a job, and the data that its workers share.

    Clear the caches first if this process uses more than half of the allowed memory.
    """
    if _used_memory() > MAX_MEMORY_BYTES / 2:
        _SCENARIO_CACHE.clear()
    prepared = _SCENARIO_CACHE.get_or_prepare(job.scenario)
    import_components(prepared)
    precompute(prepared)
    log_header(prepared, job.key.seed)
    CLIENT_POOL.create_in_advance()


def _used_memory() -> int:
    """Return the size of the address space of this process in bytes."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _execute(job: Job, report_progress: Callable[[float], None]) -> dict[str, Any]:
    """Execute the run of a job in a worker, and return its result as JSON data."""
    prepared = _SCENARIO_CACHE.get_or_prepare(job.scenario)
    progress = ProgressReporter(prepared.spec.physics.tick_rate, report_progress)
    return execute_run(prepared, job.key.seed, job.folder, (progress,), partial(_write_outputs, job))


def _write_outputs(job: Job, prepared: PreparedScenario, run: Run, folder: Path) -> None:
    """Write the picture and the replay page of a run, if the job requests them for its outcome."""
    if job.picture.includes(run.result.outcome):
        scene = Scene(run.trace, run.case, prepared.built.map, run.result, world_scenery(prepared))
        robots = {name: (robot_run.trace, robot_run.case) for name, robot_run in run.robots.items()}
        write_picture(scene_with_robots(scene, robots), folder / "map.png")
    if job.replay.includes(run.result.outcome) and run.log is not None:
        from simscen.report.replay import write_replay

        write_replay(folder / "replay.html", [(read_run(run.log, with_sensors=True), run.result)])


if __name__ == "__main__":
    main()
