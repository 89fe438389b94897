"""Program of the warm process: `python -I -m simscen.cli.session.warm_process [PLUGIN_PATH] FD`, for internal use."""

import os
import resource
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from PIL import Image

import simscen.sim.simulation
import simscen.stack.build  # noqa: F401 - engines are imported here so that the forks need not
from simscen.core.records.case import Run
from simscen.record.log_reader.read import read_run
from simscen.report.picture.map_picture import write_picture
from simscen.report.picture.scene import Scene, scene_with_robots
from simscen.run.disk_cache import DiskCache, cache_folder
from simscen.run.log_header import log_header, world_scenery
from simscen.run.preparation import PreparedScenario
from simscen.run.process.fork_server import ForkServer
from simscen.run.process.isolation import MAX_MEMORY_BYTES, apply_plugin_path
from simscen.run.process.jobs import Job, ReplayMode
from simscen.run.process.warm_up import import_components, precompute
from simscen.run.process.worker import ProgressReporter
from simscen.run.scenario_cache import CachedWorldBuilder, ScenarioCache
from simscen.run.simulate import execute_run
from simscen.sim.bullet.client_pool import CLIENT_POOL

_SCENARIOS = ScenarioCache(CachedWorldBuilder(DiskCache(cache_folder(os.environ))))
Image.preinit()  # imports now instead of in every fork that writes a picture


def main() -> None:
    """Serve the supervisor until it closes the connection."""
    *plugin_paths, replies = sys.argv[1:]
    for plugin_path in plugin_paths:
        apply_plugin_path(plugin_path)
    ForkServer(0, int(replies), _warm_up, _execute).serve()


def _warm_up(job: Job) -> None:
    """Prepare the scenario, import the modules of its runs, and compute what all of them share.

    Clears the caches first if they use more than half of the allowed memory.
    """
    if _used_memory() > MAX_MEMORY_BYTES / 2:
        _SCENARIOS.clear()
    prepared = _SCENARIOS.prepared(job.scenario)
    import_components(prepared)
    precompute(prepared)
    log_header(prepared, job.key.seed)
    CLIENT_POOL.create_in_advance()


def _used_memory() -> int:
    """Return the address space in use in bytes (Linux: field 1 of /proc/self/statm, in pages)."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _execute(job: Job, report_progress: Callable[[float], None]) -> dict[str, Any]:
    prepared = _SCENARIOS.prepared(job.scenario)
    progress = ProgressReporter(prepared.spec.physics.tick_rate, report_progress)
    return execute_run(prepared, job.key.seed, job.folder, (progress,), partial(_write_outputs, replay=job.replay))


def _write_outputs(prepared: PreparedScenario, run: Run, folder: Path, replay: ReplayMode) -> None:
    scene = Scene(run.trace, run.case, prepared.built.map, run.result, world_scenery(prepared))
    robots = {name: (one.trace, one.case) for name, one in run.robots.items()}
    write_picture(scene_with_robots(scene, robots), folder / "map.png")
    if replay.includes(run.result.outcome) and run.log is not None:
        from simscen.report.replay import write_replay

        write_replay(folder / "replay.html", [(read_run(run.log, with_sensors=True), run.result)])


if __name__ == "__main__":
    main()
