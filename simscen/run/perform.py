"""One run from beginning to end, in this process: simulate, record, judge, write."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simscen.core.time import Clock
from simscen.core.trace import Trace
from simscen.judge.judge import judge
from simscen.judge.result import RunResult, run_result, to_json
from simscen.record.header import LogHeader
from simscen.record.recorder import Recorder
from simscen.record.trace import TraceBuilder
from simscen.run.assemble import assemble
from simscen.run.lockstep import Log, run_lockstep
from simscen.run.prepare import Prepared


@dataclass(frozen=True, eq=False)
class Performed:
    """What came of a run."""

    prepared: Prepared
    trace: Trace
    result: RunResult
    folder: Path


Finish = Callable[[Performed], None]
"""What is made of a run besides its log and its result, e.g. a picture."""


def perform(prepared: Prepared, seed: int, folder: Path, logs: tuple[Log, ...], finish: Finish) -> dict[str, Any]:
    """Do the run and leave run.mcap, result.json, scenario.yaml and what `finish` makes in `folder`.

    Returns the end record: the outcome and the log's SHA-256, for the supervisor.
    """
    clock = Clock(prepared.spec.physics.tick_rate)
    builder = TraceBuilder(clock)
    log = folder / "run.mcap"
    (folder / "scenario.yaml").write_text(prepared.loaded.text, encoding="utf-8")
    with Recorder(log, clock, log_header(prepared, seed)) as recorder:
        rig = assemble(prepared, seed)
        end = run_lockstep(rig, (builder, recorder, *logs))
        trace = builder.finish(end.tick)
        result = judged(prepared, seed, trace)
        recorder.close(end.tick, to_json(result))
    rig.simulation.close()
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    finish(Performed(prepared, trace, result, folder))
    return {"outcome": result.outcome.value, "sha256": hashlib.sha256(log.read_bytes()).hexdigest()}


def judged(prepared: Prepared, seed: int, trace: Trace) -> RunResult:
    """Verdicts and metrics of a trace."""
    verdicts = judge(prepared.spec.pass_, trace, prepared.case)
    return run_result(prepared.loaded.id, prepared.loaded.path, seed, verdicts, trace, prepared.case)


def log_header(prepared: Prepared, seed: int) -> LogHeader:
    """What the log says about the run."""
    loaded = prepared.loaded
    return LogHeader(
        name=loaded.id,
        seed=seed,
        case=prepared.case,
        scenario=loaded.text,
        map=prepared.map,
        robot_description=prepared.body.urdf,
        frames=sensor_frames(prepared.robot),
    )
