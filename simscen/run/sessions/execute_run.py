"""Execute one run of a session and write its files."""

import gc
import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from simscen.core.records.run import Run
from simscen.judge.result_json import to_json
from simscen.record.backlog import Log
from simscen.run.external.build import robot_file
from simscen.run.log_header import log_header
from simscen.run.preparation.scenario import PreparedScenario
from simscen.run.simulate import simulate
from simscen.sim.alone import NAMELESS

GC_THRESHOLD = 20_000
"""Threshold of garbage collection in a worker. Runs create hardly any cycles; the default of 700 wastes time.
"""

WriteExtras = Callable[[PreparedScenario, Run, Path], None]
"""Writes further files of a run, for example a picture."""


def execute_run(
    prepared: PreparedScenario, seed: int, folder: Path, logs: tuple[Log, ...], finish: WriteExtras
) -> dict[str, Any]:
    """Execute a run and write run.mcap, result.json, scenario.yaml, and the files of `finish` to `folder`.

    The output of an external stack goes to stack.log and its description to stack.json; with several robots, to
    stack.ROBOT.log and stack.ROBOT.json.

    Returns the end record for the supervisor: the outcome and the SHA-256 of the log.
    """
    if not prepared.plugins:  # plug-ins can create any amount of garbage
        gc.set_threshold(GC_THRESHOLD)
    log = folder / "run.mcap"
    (folder / "scenario.yaml").write_text(log_header(prepared, seed).scenario, encoding="utf-8")
    run = simulate(prepared, seed, log=log, attach=lambda *_: logs, printed=folder / "stack.log")
    (folder / "result.json").write_text(to_json(run.result), encoding="utf-8")
    for name, one in (run.robots or {NAMELESS: run}).items():
        if one.stack:
            file = robot_file(folder / "stack.json", name)
            file.write_text(json.dumps(one.stack, indent=1) + "\n", encoding="utf-8")
    finish(prepared, run, folder)
    return {"outcome": run.result.outcome.value, "sha256": hashlib.sha256(log.read_bytes()).hexdigest()}
