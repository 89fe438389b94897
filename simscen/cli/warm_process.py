"""The program of the warm process: `python -I -m simscen.cli.warm_process FD`. Not for people."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import simscen.sim.simulation
import simscen.stack.build  # noqa: F401 - engines are imported here so that the forks need not
from simscen.core.run import Run
from simscen.report.picture import Scene, write_picture
from simscen.run.jobs import Job
from simscen.run.perform import perform
from simscen.run.prepare import Prepared
from simscen.run.prepared_cache import PreparedCache
from simscen.run.worker import Progress
from simscen.run.zygote import Zygote

_PREPARED = PreparedCache()


def main() -> None:
    """Serve the supervisor until it closes its end."""
    replies = int(sys.argv[1])
    Zygote(sys.stdin.buffer, replies, lambda job: _PREPARED.prepared(job.scenario), _perform).serve()


def _perform(job: Job, tell: Callable[[float], None]) -> dict[str, Any]:
    prepared = _PREPARED.prepared(job.scenario)
    progress = Progress(prepared.spec.physics.tick_rate, tell)
    return perform(prepared, job.key.seed, job.folder, (progress,), _finish)


def _finish(prepared: Prepared, run: Run, folder: Path) -> None:
    world = prepared.built.world
    scene = Scene(run.trace, run.case, prepared.built.map, run.result, world.places, world.bodies)
    write_picture(scene, folder / "map.png")


if __name__ == "__main__":
    main()
