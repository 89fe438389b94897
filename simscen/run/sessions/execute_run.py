"""One run of a session in its own process: simulate it and leave its files in its folder."""

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
"""So many more objects than before, and Python looks for garbage in a run's process, which hardly makes any. Its own
700 are what moments hold that wait: thirty searches a minute of the patrol, a hundred where twenty carts drive.
"""

WriteExtras = Callable[[PreparedScenario, Run, Path], None]
"""What is made of a run in its folder besides its log and its result, e.g. a picture."""


def execute_run(
    prepared: PreparedScenario, seed: int, folder: Path, logs: tuple[Log, ...], finish: WriteExtras
) -> dict[str, Any]:
    """Do the run and leave run.mcap, result.json, scenario.yaml and what `finish` makes in `folder`.

    What an external stack prints goes to stack.log there, what it says of itself to stack.json; of several robots, to
    stack.ROBOT.log and stack.ROBOT.json.

    Returns the end record: the outcome and the log's SHA-256, for the supervisor.
    """
    if not prepared.plugins:  # code of others may make any amount
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
