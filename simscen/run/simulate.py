"""Execute one run: simulate a prepared scenario in lockstep, record the run, and judge it."""

import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from simscen.core.clock import Clock
from simscen.core.errors import InvalidInput, RunError
from simscen.core.records.case import SINGLE_ROBOT_NAME, Run
from simscen.core.records.trace import Trace
from simscen.judge.result_json import to_json
from simscen.judge.run_result import judge_run
from simscen.judge.several_robots import combine_robots
from simscen.record.moment_buffer import MOMENT_DELAY_S, MomentBuffer, MomentSink
from simscen.record.recorder import Recorder
from simscen.record.trace_builder import TraceBuilder
from simscen.record.trace_thinning import Thinning
from simscen.run.assembly import assemble
from simscen.run.external.stack import ExternalStack
from simscen.run.faults.map_faults import apply_map_faults
from simscen.run.lockstep import RunSetup, run_lockstep
from simscen.run.log_header import log_header
from simscen.run.preparation import PreparedScenario
from simscen.run.robot_interface import sensor_kinds
from simscen.spec.registry import RegisteredType

AttachLogs = Callable[[RunSetup, Sequence[MomentSink]], Sequence[MomentSink]]
"""Function that takes the setup of a run and the logs of its first robot, and returns more logs for this robot."""


def simulate(
    prepared: PreparedScenario,
    seed: int | None = None,
    *,
    log: Path | None = None,
    attach: AttachLogs | None = None,
    stack_log: Path | None = None,
) -> Run:
    """Run a prepared scenario with a seed (default: the scenario's own) and judge the run.

    `log` is the MCAP file to write (None: no log). `attach` adds logs before the simulation starts. `stack_log` is the
    file for the output of an external stack; with several robots, the name of the robot is added to the file name.

    *Given* the same scenario and seed *then* the same run and the same bytes in `log`, regardless of earlier runs in
    this process. Raises RunError if the run cannot be completed, and OSError if the log cannot be written.
    """
    try:
        return _run_and_judge(prepared, prepared.spec.seed if seed is None else seed, log, attach, stack_log)
    except (RunError, InvalidInput, MemoryError):
        raise
    except Exception as error:  # plug-ins can raise any exception
        if (plugin_failure := plugin_error(error, prepared.plugins)) is None:
            raise
        traceback.print_exc()  # goes to worker.log, for the author of the plug-in
        raise plugin_failure from error


def _run_and_judge(
    prepared: PreparedScenario, seed: int, log: Path | None, attach: AttachLogs | None, stack_log: Path | None
) -> Run:
    prepared = apply_map_faults(prepared, seed)
    clock = Clock(prepared.spec.physics.tick_rate)
    with ExitStack() as cleanup:
        recorder = log and cleanup.enter_context(Recorder(log, clock, log_header(prepared, seed)))
        # Plug-ins could modify an array after they returned it, so logging must not be delayed.
        delay, robot_logs = 0 if prepared.plugins else clock.ticks(MOMENT_DELAY_S), recorder.robots if recorder else {}
        backlog = cleanup.enter_context(MomentBuffer(delay, next(iter(robot_logs.values()), None)))
        builders = {
            name: TraceBuilder(
                clock, robot_logs[name].thinning if recorder else Thinning(clock.rate, sensor_kinds(part))
            )
            for name, part in prepared.by_robot.items()
        }
        setup = assemble(prepared, seed, stack_log)
        cleanup.callback(setup.simulation.close)
        robots = dict(zip(prepared.by_robot, setup.robots, strict=True))
        stacks = {name: robot.stack for name, robot in robots.items()}
        external_stacks = {name: stack for name, stack in stacks.items() if isinstance(stack, ExternalStack)}
        cleanup.callback(_close, external_stacks.values())
        for name, stack in external_stacks.items():
            stack.begin(prepared.by_robot[name].estimate)
        for name, robot in robots.items():
            part = prepared.by_robot[name]
            robot.stack.start(part.estimate, part.case.goals)
        logs = [(builders[name], robot_logs[name]) if robot_logs else (builders[name],) for name in robots]
        for robot, robot_sinks in zip(setup.robots, logs, strict=True):
            robot.logs = (backlog.sink(*robot_sinks),)
        setup.robots[0].logs += tuple(attach(setup, logs[0])) if attach else ()
        end = run_lockstep(setup)
        backlog.flush()
        for stack in external_stacks.values():
            stack.end(end.name)
        for stack in external_stacks.values():
            stack.finish()
        _close(external_stacks.values())
        run = _judge_traces(prepared, seed, {name: builder.finish(end.tick) for name, builder in builders.items()}, log)
        if recorder:
            facts = {  # by `FACT` for a single robot, else by `ROBOT.FACT`
                f"{name}.{fact}" if name else fact: value
                for name, stack in external_stacks.items()
                for fact, value in stack.facts.items()
            }
            recorder.close(end.tick, to_json(run.result), facts)
    descriptions = {name: stack.description for name, stack in external_stacks.items()}
    runs = {name: replace(robot_run, stack=descriptions.get(name, {})) for name, robot_run in run.robots.items()}
    return replace(run, robots=runs, stack=descriptions.get(next(iter(runs), SINGLE_ROBOT_NAME), {}))


def _close(stacks: Collection[ExternalStack]) -> None:
    """End the processes of external stacks, all at the same time."""
    for stack in stacks:
        stack.release()
    for stack in stacks:
        stack.close()


def _judge_traces(prepared: PreparedScenario, seed: int, traces: Mapping[str, Trace], log: Path | None) -> Run:
    """Judge the traces of all robots, given by robot name. `log` is the MCAP file."""
    runs = {name: _judge_robot(part, seed, traces[name], log) for name, part in prepared.by_robot.items()}
    first = next(iter(runs.values()))
    if not prepared.robots:
        return first
    result = combine_robots({name: run.result for name, run in runs.items()}, traces, prepared.loaded.expected_failure)
    return replace(first, result=result, robots=runs)


def _judge_robot(prepared: PreparedScenario, seed: int, trace: Trace, log: Path | None) -> Run:
    loaded = prepared.loaded
    places = [loaded.position_of("pass", index) for index in range(len(prepared.spec.pass_))]
    # Entries from `extends` or defaults.yaml have no line in the file that reports name.
    lines = tuple(place.line if place.path == loaded.path else 0 for place in places)
    result = judge_run(
        loaded.key(seed),
        loaded.path,
        prepared.spec.pass_,
        trace,
        prepared.case,
        lines,
        metrics=prepared.spec.metrics,
        expected=loaded.expected_failure,
    )
    return Run(replace(result, stack=loaded.stack), trace, prepared.case, log)


def plugin_error(error: Exception, plugins: Sequence[RegisteredType]) -> RunError | None:
    """Return a RunError with the name of the plug-in that raised an exception, or None if no plug-in raised it."""
    for frame, line in reversed(list(traceback.walk_tb(error.__traceback__))):
        module = str(frame.f_globals.get("__name__", ""))
        package = module.partition(".")[0]
        candidates = [entry for entry in plugins if entry.value.partition(":")[0].partition(".")[0] == package]
        if candidates:
            # The plug-in that is defined in this module, or else the first one of the package.
            entry = next((entry for entry in candidates if entry.value.partition(":")[0] == module), candidates[0])
            place = f"{frame.f_code.co_filename.rpartition('/')[2]}:{line}"
            summary = f"{type(error).__name__}: {error}".splitlines()[0]
            return RunError("crashed", f"{entry.group} `{entry.name}` of {entry.origin}: {summary} ({place})")
    return None
