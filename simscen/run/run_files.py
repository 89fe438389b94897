"""Execute one run in a worker process, and write its files: log, result, scenario, and facts about external stacks."""

import gc
import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from simscen.core.records.case import SINGLE_ROBOT_NAME, Run
from simscen.judge.result_json import to_json
from simscen.record.moment_buffer import MomentSink
from simscen.run.external.build import robot_file
from simscen.run.log_header import log_header
from simscen.run.preparation import PreparedScenario
from simscen.run.simulate import simulate

GC_THRESHOLD = 20_000
"""Number of new objects after which Python collects garbage in a worker process; large, to save time."""

WriteExtras = Callable[[PreparedScenario, Run, Path], None]
"""Function that writes additional files of a run to a folder, for example a picture."""


def execute_run(
    prepared: PreparedScenario, seed: int, folder: Path, logs: tuple[MomentSink, ...], write_extras: WriteExtras
) -> dict[str, Any]:
    """Execute a run in a worker process, and write all its files to `folder`.

    The files are run.mcap, result.json, scenario.yaml, and for an external stack stack.log and stack.json (with several
    robots stack.ROBOT.log and stack.ROBOT.json). `write_extras` writes more files. The moments (recorded beats) of the
    first robot are also appended to `logs`. Returns a dict with the keys `outcome` and `sha256` (of run.mcap).
    """
    if not prepared.plugins:  # plug-ins can create any amount of garbage
        gc.set_threshold(GC_THRESHOLD)
    log = folder / "run.mcap"
    (folder / "scenario.yaml").write_text(log_header(prepared, seed).scenario, encoding="utf-8")
    run = simulate(prepared, seed, log=log, attach=lambda *_: logs, stack_log=folder / "stack.log")
    (folder / "result.json").write_text(to_json(run.result), encoding="utf-8")
    for name, robot_run in (run.robots or {SINGLE_ROBOT_NAME: run}).items():
        if robot_run.stack:
            file = robot_file(folder / "stack.json", name)
            file.write_text(json.dumps(robot_run.stack, indent=1) + "\n", encoding="utf-8")
    write_extras(prepared, run, folder)
    return {"outcome": run.result.outcome.value, "sha256": hashlib.sha256(log.read_bytes()).hexdigest()}
