"""The program of the warm process: `python -I -m simscen.cli.session.warm_process [WHEREABOUTS] FD`. Not for people."""

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
from simscen.core.records.run import Run
from simscen.record.replay import read_run
from simscen.report.picture.compose import write_picture
from simscen.report.picture.scene import Scene, with_robots
from simscen.run.keptfiles import KeptFiles, cache_folder
from simscen.run.keptworlds import KeptWorlds
from simscen.run.logheader import log_header
from simscen.run.perform import perform
from simscen.run.preload import import_components, work_out_ahead
from simscen.run.prepare import Prepared
from simscen.run.prepared_cache import PreparedCache
from simscen.run.process.confine import MEMORY_BYTES
from simscen.run.process.jobs import Job, Replays
from simscen.run.process.whereabouts import settle_in
from simscen.run.process.worker import Progress
from simscen.run.process.zygote import Zygote
from simscen.run.scenery import scenery_of
from simscen.sim.clients import CLIENTS

_PREPARED = PreparedCache(KeptWorlds(KeptFiles(cache_folder(os.environ))))
Image.preinit()  # imports what it would import when the first picture is written


def main() -> None:
    """Serve the supervisor until it closes its end."""
    *told, replies = sys.argv[1:]
    for whereabouts in told:
        settle_in(whereabouts)
    Zygote(0, int(replies), _warm_up, _perform).serve()


def _warm_up(job: Job) -> None:
    """Prepare the scenario, import what its runs need, and make what is the same in all of them.

    Before what is kept takes more than half of the memory there is, it is let go.
    """
    if _memory() > MEMORY_BYTES / 2:
        _PREPARED.clear()
    prepared = _PREPARED.prepared(job.scenario)
    import_components(prepared)
    work_out_ahead(prepared)
    log_header(prepared, job.key.seed)
    CLIENTS.make_ahead()


def _memory() -> int:
    """The address space in use, in bytes, which is what is bounded (Linux: field 1 of /proc/self/statm, in pages)."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _perform(job: Job, tell: Callable[[float], None]) -> dict[str, Any]:
    prepared = _PREPARED.prepared(job.scenario)
    progress = Progress(prepared.spec.physics.tick_rate, tell)
    return perform(prepared, job.key.seed, job.folder, (progress,), partial(_finish, replay=job.replay))


def _finish(prepared: Prepared, run: Run, folder: Path, replay: Replays) -> None:
    scene = Scene(run.trace, run.case, prepared.built.map, run.result, scenery_of(prepared))
    robots = {name: (one.trace, one.case) for name, one in run.robots.items()}
    write_picture(with_robots(scene, robots), folder / "map.png")
    if replay.wants(run.result.outcome) and run.log is not None:
        from simscen.report.replay import write_replay

        write_replay(folder / "replay.html", [(read_run(run.log, looks=True), run.result)])


if __name__ == "__main__":
    main()
