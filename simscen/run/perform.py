"""One run from beginning to end, in this process: simulate, record, judge, write."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simscen.core.geometry import Pose3
from simscen.core.result import RunKey, RunResult
from simscen.core.time import Clock
from simscen.core.trace import Trace
from simscen.judge.judge import judge
from simscen.judge.result import run_result
from simscen.judge.resultdata import to_json
from simscen.loading.resolved import resolved_text
from simscen.model.robot import RobotSpec
from simscen.record.header import LogHeader
from simscen.record.recorder import Recorder
from simscen.record.tracebuilder import TraceBuilder
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


def perform(prepared: Prepared, key: RunKey, folder: Path, logs: tuple[Log, ...], finish: Finish) -> dict[str, Any]:
    """Do the run and leave run.mcap, result.json, scenario.yaml and what `finish` makes in `folder`.

    Returns the end record: the outcome and the log's SHA-256, for the supervisor.
    """
    clock = Clock(prepared.spec.physics.tick_rate)
    builder = TraceBuilder(clock)
    log = folder / "run.mcap"
    (folder / "scenario.yaml").write_text(resolved_text(prepared.loaded), encoding="utf-8")
    with Recorder(log, clock, log_header(prepared, key.seed)) as recorder:
        rig = assemble(prepared, key.seed)
        end = run_lockstep(rig, (builder, recorder, *logs))
        trace = builder.finish(end.tick)
        result = judged(prepared, key, trace)
        recorder.close(end.tick, to_json(result))
    rig.simulation.close()
    (folder / "result.json").write_text(to_json(result), encoding="utf-8")
    finish(Performed(prepared, trace, result, folder))
    return {"outcome": result.outcome.value, "sha256": hashlib.sha256(log.read_bytes()).hexdigest()}


def judged(prepared: Prepared, key: RunKey, trace: Trace) -> RunResult:
    """Verdicts and metrics of a trace."""
    loaded = prepared.loaded
    verdicts = judge(prepared.spec.pass_, trace, prepared.case)
    lines = tuple(loaded.place_of("pass", index).line for index in range(len(verdicts)))
    # The second of two equal runs must say the same as the first, so the variation is not part of the result.
    return run_result(key.scenario, loaded.path, key.seed, verdicts, trace, prepared.case, lines=lines)


def log_header(prepared: Prepared, seed: int) -> LogHeader:
    """What the log says about the run."""
    return LogHeader(
        name=prepared.loaded.id,
        seed=seed,
        case=prepared.case,
        scenario=resolved_text(prepared.loaded),
        map=prepared.map,
        robot_description=prepared.body.urdf,
        frames=_sensor_frames(prepared.robot),
    )


def _sensor_frames(robot: RobotSpec) -> dict[str, Pose3]:
    """Where lidars and cameras sit on the base."""
    mounts = {name: (s.lidar or s.camera) for name, s in robot.sensors.items()}
    return {
        name: Pose3.from_rpy(sensor.mount.x, sensor.mount.y, sensor.mount.z, 0.0, 0.0, sensor.mount.yaw)
        for name, sensor in mounts.items()
        if sensor is not None
    }
