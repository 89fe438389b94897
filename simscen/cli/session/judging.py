"""Evaluation of recorded logs for `simscen judge`, with the criteria in the log or in a separate criteria file."""

from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from simscen.cli.diagnostics import paths_from_working_folder, relative_to_working_folder
from simscen.cli.session.logs import (
    COMPLETE_LOG,
    PARTIAL_LOG,
    evaluate_recorded_criteria,
    find_sessions,
    log_name,
    recorded_result,
)
from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose2
from simscen.core.records.case import Case
from simscen.core.records.events import EventKind
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult, error_result, skipped_result
from simscen.core.records.session_events import Artifacts, RunFinished
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Evidence, ExpectedFailure, LogCoverage
from simscen.criteria.timeline import START_KINDS, has_ended
from simscen.judge.run_result import judge_run
from simscen.judge.several_robots import combine_robots
from simscen.loading.files.criteria_file import LoadedCriteria, load_criteria
from simscen.loading.files.discovery import default_root
from simscen.loading.spec_walk import references
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode
from simscen.model.scenario import expected_failure
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.raw_messages import is_simscen_log
from simscen.record.foreign.read import ForeignLog, read_foreign_log
from simscen.record.log_header import LogHeader
from simscen.record.log_reader import Log, read_run
from simscen.report.journal_reader import read_journal
from simscen.run.sessions.output_folder import run_folder


class LogJudge:
    """Evaluates logs of simscen, and foreign logs, which simscen did not write.

    `notes` are messages about the logs, `foreign_count` is the number of foreign logs so far.
    """

    def __init__(
        self, options: ForeignLogOptions, scenario: Path | None, root: Path | None, world_path: Sequence[Path]
    ) -> None:
        """Read the criteria file `scenario`; None to use the criteria in each log. Raises InvalidInput.

        `options` are for reading foreign logs. `root` and `world_path` are for the criteria file.
        """
        self.notes: list[str] = []
        self.foreign_count = 0
        self._options, self._scenario = options, scenario
        self._file_masks: Mapping[str, MaskBlocks] | None = None
        self._file_objects: frozenset[str] | None = None
        self._criteria: LoadedCriteria | None = None
        if scenario is not None:
            root_folder = root or default_root([scenario])
            with paths_from_working_folder(root_folder):
                self._criteria = load_criteria(scenario, root_folder, world_path)

    def judge(self, log: Path, is_only_log: bool) -> RunFinished:
        """Evaluate a log and return its result.

        If the evaluation fails, the result is an error. If `is_only_log` is true, the exception is raised instead.
        Raises InvalidCriteriaFile if the criteria file is invalid.
        """
        try:
            return self._judge_simscen_log(log) if _is_written_by_simscen(log) else self._judge_foreign(log)
        except InvalidInput as error:
            if is_only_log or isinstance(error, InvalidCriteriaFile):
                raise
            reason = "; ".join(": ".join(filter(None, (problem.message, problem.hint))) for problem in error.problems)
            return _not_judged(log, RunFailure("invalid", reason))
        except Exception as error:  # a defect of simscen must not lose the verdicts of the other logs
            if is_only_log:
                raise
            reason = f"{type(error).__name__}: {error}; judge this log alone for the traceback"
            return _not_judged(log, RunFailure("internal", reason))

    def judge_for_replay(self, log: Path) -> tuple[Log, RunResult]:
        """Return a log with its sensor data, and its result. Raises InvalidInput if the log is unusable."""
        if _is_written_by_simscen(log):
            read = read_run(log, with_sensors=True)
            return read, recorded_result(read, log) if self._criteria is None else self._judge_simscen_log(log).result
        self.foreign_count += 1
        if self._criteria is None:
            foreign, case = read_foreign_log(log, self._options, with_sensors=True), Case(Pose2(0.0, 0.0), ())
            result = skipped_result(RunKey(log_name(log), 0), "", "not evaluated; set criteria with --scenario")
            result = replace(
                result, simulated=foreign.trace.seconds(foreign.trace.end), tick_rate=foreign.trace.tick_rate
            )
        else:
            foreign, result = self._judge_foreign_log(log, with_sensors=True)
            case = self._foreign_case
        self.notes += [f"{log}: {note}" for note in foreign.notes]
        text = "" if self._scenario is None else self._scenario.read_text(encoding="utf-8")
        header = LogHeader(log_name(log), 0, case, text, foreign.map)
        return Log(header, foreign.trace, "", complete=has_ended(foreign.trace), sensors=foreign.sensors), result

    def _judge_simscen_log(self, log: Path) -> RunFinished:
        read = read_run(log)
        if self._criteria is None:
            result = evaluate_recorded_criteria(read, log, str(log))
            return RunFinished(result, artifacts=Artifacts(mcap=str(log)), file=str(log))
        if not read.robots:
            return self._judge_robot(log, read, self._criteria, "")
        runs = {name: self._judge_robot(log, part, self._criteria, name) for name, part in read.robots.items()}
        traces = {name: robot_log.trace for name, robot_log in read.robots.items()}
        expected = expected_failure(self._criteria.spec)
        result = combine_robots({name: run.result for name, run in runs.items()}, traces, expected)
        return replace(next(iter(runs.values())), result=result)

    def _judge_robot(self, log: Path, read: Log, criteria_file: LoadedCriteria, robot: str) -> RunFinished:
        """Evaluate `read`, the part of a log about one robot, with the criteria file.

        `robot` is the name of the robot; "" for the only robot.
        """
        header, case = read.header, read.header.case
        with _as_invalid_criteria_file(criteria_file):
            criteria = criteria_file.for_robot(robot)
        # The disturbances are in the scenario of the log, at lines that the criteria file does not have.
        case = replace(case, disturbances=tuple(replace(disturbance, line=0) for disturbance in case.disturbances))
        labels, objects = _names_in_log(read)
        if any(reference.target == "object" for reference in references(criteria.spec)):
            objects |= self._world_objects(criteria)
        case = replace(case, masks={**case.masks, **self._masks(criteria)}, labels=labels, objects=objects)
        # `expected` of a file without `robots` applies to the run, not to each robot.
        expected = None if robot else expected_failure(criteria.spec)
        return self._judge_by_file(log, header.key, read.trace, case, read.coverage, criteria, expected)

    def _judge_foreign(self, log: Path) -> RunFinished:
        self.foreign_count += 1
        if self._criteria is None:
            hint = "set criteria with --scenario; a file with `pass:` is enough"
            raise InvalidInput([Problem(str(log), 0, 0, "SC801", "not a log of simscen", hint)])
        read, result = self._judge_foreign_log(log)
        self.notes += [f"{log}: {note}" for note in read.notes]
        return RunFinished(result, artifacts=Artifacts(mcap=str(log)), file=str(self._scenario))

    def _judge_foreign_log(self, log: Path, with_sensors: bool = False) -> tuple[ForeignLog, RunResult]:
        """Return a foreign log, and its result according to the criteria file."""
        assert self._criteria is not None
        with _as_invalid_criteria_file(self._criteria):
            criteria = self._criteria.for_robot("")
        case = self._foreign_case
        goals = tuple(goal.name for goal in case.goals if not goal.via)
        read = read_foreign_log(log, replace(self._options, goals=goals), with_sensors)
        missing = dict(read.coverage.missing)
        if case.footprint:
            del missing[Evidence.FOOTPRINT]
        coverage = replace(read.coverage, missing=missing)
        key, expected = RunKey(log_name(log), 0), expected_failure(criteria.spec)
        return read, self._judge_by_file(log, key, read.trace, case, coverage, criteria, expected).result

    def _masks(self, criteria: LoadedCriteria) -> Mapping[str, MaskBlocks]:
        """Return the costmap filter masks that the criteria use, by file."""
        if criteria is self._criteria and self._file_masks is not None:
            return self._file_masks
        from simscen.loading.builders import load_criterion_masks

        with _as_invalid_criteria_file(criteria):
            masks = load_criterion_masks(criteria.masks, criteria.tree, criteria.library.texts)
        self._file_masks = masks if criteria is self._criteria else self._file_masks
        return masks

    def _world_objects(self, criteria: LoadedCriteria) -> frozenset[str]:
        """Return the names of the objects in the world that the criteria file names."""
        if self._file_objects is None:
            from simscen.run.criteria_case import world_of_criteria

            with _as_invalid_criteria_file(criteria):
                world = world_of_criteria(criteria)
            self._file_objects = frozenset(
                [*(body.name for body in world.bodies), *(solid.name for solid in world.solids)]
            )
        return self._file_objects

    @cached_property
    def _foreign_case(self) -> Case:
        """Goals, regions, footprint, and other data of the criteria file that criteria need."""
        from simscen.run.criteria_case import case_from_criteria

        assert self._criteria is not None
        with _as_invalid_criteria_file(self._criteria):
            return case_from_criteria(self._criteria)

    def _judge_by_file(
        self,
        log: Path,
        key: RunKey,
        trace: Trace,
        case: Case,
        coverage: LogCoverage,
        criteria: LoadedCriteria,
        expected: ExpectedFailure | None,
    ) -> RunFinished:
        """Evaluate a trace (the recorded states of a run) with criteria of the criteria file."""
        file, spec = str(self._scenario), criteria.spec
        result = judge_run(key, file, spec.pass_, trace, case, criteria.lines, coverage, spec.metrics, expected)
        return RunFinished(result, artifacts=Artifacts(mcap=str(log)), file=file)


def _names_in_log(log: Log) -> tuple[frozenset[str], frozenset[str]]:
    """Return the names of all events, faults, and marks in a log and its scenario, and the names of all objects.

    The objects of world files are not included.
    """
    tree, _ = parse_yaml(log.header.scenario, "scenario.yaml")
    scenario = tree.plain if isinstance(tree, MappingNode) else {}
    world = scenario.get("world")
    walls = len(world.get("walls") or ()) if isinstance(world, Mapping) else 0
    events = log.trace.of_kind(*START_KINDS), log.trace.of_kind(EventKind.OBJECT_SPAWNED, EventKind.COLLISION_STARTED)
    started, objects = ({event.name for event in kind} for kind in events)
    planned = {disturbance.name for disturbance in log.header.case.disturbances}
    added = _names(scenario, {"spawn", "pedestrian"}) | _names(world) | {f"wall_{k + 1}" for k in range(walls)}
    return frozenset(planned | started | _names(scenario, {"mark"})), frozenset(objects | added)


def _names(plain: object, keys: Set[str] | None = None, key: str = "") -> set[str]:
    """Return the values of all keys `name` in YAML data. `key` is the key of these data in their parent mapping.

    With `keys`, return only the names of mappings that are values of these keys.
    """
    if isinstance(plain, list):
        return {name for part in plain for name in _names(part, keys, key)}
    if not isinstance(plain, Mapping):
        return set()
    names = {str(plain["name"])} if "name" in plain and (keys is None or key in keys) else set()
    return names.union(*(_names(part, keys, child_key) for child_key, part in plain.items()))


def _not_judged(log: Path, failure: RunFailure) -> RunFinished:
    """Return an error as the result of a log."""
    return RunFinished(
        error_result(RunKey(log_name(log), 0), str(log), failure), artifacts=Artifacts(mcap=str(log)), file=str(log)
    )


def _is_written_by_simscen(log: Path) -> bool:
    """Return whether simscen wrote a log. The logs of simscen are never folders or files of the rosbag formats."""
    return not log.is_dir() and log.suffix not in (".db3", ".bag") and is_simscen_log(log)


class InvalidCriteriaFile(InvalidInput):
    """The criteria file is invalid, so that no log can be evaluated."""


@contextmanager
def _as_invalid_criteria_file(criteria: LoadedCriteria) -> Iterator[None]:
    """Convert InvalidInput to InvalidCriteriaFile within the context."""
    try:
        yield
    except InvalidInput as error:
        raise InvalidCriteriaFile(relative_to_working_folder(error.problems, criteria.library.sandbox.root)) from error


def runs_without_log(paths: Sequence[Path]) -> list[tuple[str, RunFinished]]:
    """Return the folder and the result of each run without a log, in the sessions at and below the paths.

    The result is an error, except for skipped runs.
    """
    return [
        (str(run_folder(session, run.key)), _as_error(run))
        for session in find_sessions(paths)
        for run in read_journal(session).runs
        if not any((run_folder(session, run.key) / log).exists() for log in (COMPLETE_LOG, PARTIAL_LOG))
    ]


def _as_error(run: RunFinished) -> RunFinished:
    """Return a run without a log as an error, unless it was skipped."""
    if run.outcome is Outcome.SKIPPED:
        return run
    error = run.result.error
    reason = f": {error.message}" if error else ""
    failure = RunFailure(error.kind if error else "crashed", f"the run left no log{reason}")
    return RunFinished(error_result(run.key, run.result.path, failure), file=run.file)
