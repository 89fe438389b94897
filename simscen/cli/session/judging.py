"""Judges one log after the other, each by its own criteria or all by those of a file."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from simscen.cli.diagnostics import from_here
from simscen.cli.session.logs import COMPLETE_LOG, PARTIAL_LOG, recorded_result
from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose2
from simscen.core.records.case import Case
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult, error_result, skipped_result
from simscen.core.records.session_events import Artifacts, RunFinished
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Evidence, LogCoverage
from simscen.judge.run_result import combine_robots, judge_run
from simscen.loading.files.criteriafile import LoadedCriteria, load_criteria
from simscen.loading.files.discovery import default_root
from simscen.loading.resolved import criteria_of_text
from simscen.model.criteria_file import expected_failure
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.raw_messages import is_simscen_log
from simscen.record.foreign.read import ForeignLog, read_foreign_log
from simscen.record.log_header import LogHeader
from simscen.record.log_reader.read import Log, read_run
from simscen.report.journal_reader import JOURNAL_FILE, read_journal
from simscen.run.sessions.output_folder import run_folder


class LogJudge:
    """Judges logs by `scenario`, or each by its own; `notes` are what is odd about them.

    `foreign` is how many of them simscen did not write.
    """

    def __init__(
        self, wanted: ForeignLogOptions, scenario: Path | None, root: Path | None, world_path: Sequence[Path]
    ) -> None:
        self.notes: list[str] = []
        self.foreign = 0
        self._wanted, self._scenario, self._world_path = wanted, scenario, world_path
        self._case: Case | None = None
        self._named: Mapping[str, MaskBlocks] | None = None
        self._criteria: LoadedCriteria | None = None
        if scenario is not None:
            home = root if root is not None else default_root([scenario])
            try:
                self._criteria = load_criteria(scenario, home, world_path)
            except InvalidInput as error:
                raise InvalidInput(from_here(error.problems, home)) from error

    def judged(self, log: Path, alone: bool) -> RunFinished:
        """What a log says. One that cannot be used is an error of its own among several; alone it is the command's."""
        try:
            return self._own(log) if _may_be_own(log) and is_simscen_log(log) else self._foreign(log)
        except InvalidInput as error:
            if alone or isinstance(error, UnusableScenario):
                raise
            told = "; ".join(": ".join(filter(None, (one.message, one.hint))) for one in error.problems)
            result = error_result(RunKey(log.stem, 0), str(log), RunFailure("invalid", told))
            return RunFinished(result, artifacts=Artifacts(mcap=str(log)), file=str(log))

    def shown(self, log: Path) -> tuple[Log, RunResult]:
        """A log with all that there is to see in it, and what its criteria say, or those of the file.

        Raises InvalidInput.
        """
        if _may_be_own(log) and is_simscen_log(log):
            read = read_run(log, looks=True)
            return read, recorded_result(read, log) if self._criteria is None else self._own(log).result
        self.foreign += 1
        if self._criteria is None:
            told, case = read_foreign_log(log, self._wanted, looks=True), Case(Pose2(0.0, 0.0), ())
            result = skipped_result(RunKey(log.stem, 0), "", "nothing was judged: --scenario says by what")
            result = replace(result, simulated=told.trace.seconds(told.trace.end), tick_rate=told.trace.tick_rate)
        else:
            told, result = self._judged_foreign(log, looks=True)
            case = self._foreign_case()
        self.notes += [f"{log}: {note}" for note in told.notes]
        text = "" if self._scenario is None else self._scenario.read_text(encoding="utf-8")
        about = LogHeader(log.stem, 0, case, text, told.map)
        return Log(about, told.trace, "", complete=True, seen=told.seen), result

    def _own(self, log: Path) -> RunFinished:
        read = read_run(log)
        if not read.robots:
            return self._of_one(log, read, "")
        runs = {name: self._of_one(log, one, name) for name, one in read.robots.items()}
        traces = {name: one.trace for name, one in read.robots.items()}
        said = criteria_of_text(read.about.scenario, str(log), read.about.facts)
        expected = expected_failure(said if self._criteria is None else self._criteria.spec)
        result = combine_robots({name: run.result for name, run in runs.items()}, traces, expected)
        return replace(next(iter(runs.values())), result=result)

    def _of_one(self, log: Path, read: Log, robot: str) -> RunFinished:
        """What a log says of its only robot, or of one of several."""
        about, case = read.about, read.about.case
        key = about.key
        if self._criteria is None:
            spec = criteria_of_text(about.scenario, str(log), about.facts, robot)
            expected = expected_failure(spec)
            result = judge_run(key, str(log), spec.pass_, read.trace, case, (), read.coverage, spec.metrics, expected)
            return RunFinished(result, artifacts=Artifacts(mcap=str(log)), file=str(log))
        with _scenario_errors(self._criteria):
            criteria = self._criteria.of(robot)
        # What had to happen stands in the scenario of the log, at lines that the file of criteria does not have.
        case = replace(case, disturbances=tuple(replace(one, line=0) for one in case.disturbances))
        case = replace(case, masks={**case.masks, **self._masks(criteria)})
        return self._finished(log, key, read.trace, case, read.coverage, criteria)

    def _foreign(self, log: Path) -> RunFinished:
        self.foreign += 1
        if self._criteria is None:
            hint = "say with --scenario what must hold; a file with `pass:` is enough"
            raise InvalidInput([Problem(str(log), 0, 0, "SC801", "not a log of simscen", hint)])
        read, result = self._judged_foreign(log)
        self.notes += [f"{log}: {note}" for note in read.notes]
        return RunFinished(result, artifacts=Artifacts(mcap=str(log)), file=str(self._scenario))

    def _judged_foreign(self, log: Path, looks: bool = False) -> tuple[ForeignLog, RunResult]:
        """A log of others, and what the file of criteria says of it."""
        assert self._criteria is not None
        with _scenario_errors(self._criteria):
            criteria = self._criteria.of("")
        case = self._foreign_case()
        goals = tuple(goal.name for goal in case.goals if not goal.via)
        read = read_foreign_log(log, replace(self._wanted, goals=goals), looks)
        missing = dict(read.coverage.missing)
        if case.footprint:
            del missing[Evidence.FOOTPRINT]
        coverage = replace(read.coverage, missing=missing)
        return read, self._finished(log, RunKey(log.stem, 0), read.trace, case, coverage, criteria).result

    def _masks(self, criteria: LoadedCriteria) -> Mapping[str, MaskBlocks]:
        """The filter masks that criteria name; those of a file that is the same for all robots are read once."""
        if criteria is self._criteria and self._named is not None:
            return self._named
        from simscen.run.preparation.foreign_logs import masks_from_criteria

        with _scenario_errors(criteria):
            named = masks_from_criteria(criteria) if criteria.masks else {}
        self._named = named if criteria is self._criteria else self._named
        return named

    def _foreign_case(self) -> Case:
        """What the file of criteria says about the robot's surroundings; read once."""
        assert self._criteria is not None
        if self._case is None:
            from simscen.run.preparation.foreign_logs import case_from_criteria

            with _scenario_errors(self._criteria):
                self._case = case_from_criteria(self._criteria, self._world_path)
        return self._case

    def _finished(
        self, log: Path, key: RunKey, trace: Trace, case: Case, coverage: LogCoverage, criteria: LoadedCriteria
    ) -> RunFinished:
        """Judged by the file of criteria."""
        file, spec = str(self._scenario), criteria.spec
        expected = expected_failure(spec)
        result = judge_run(key, file, spec.pass_, trace, case, criteria.lines, coverage, spec.metrics, expected)
        return RunFinished(result, artifacts=Artifacts(mcap=str(log)), file=file)


def _may_be_own(log: Path) -> bool:
    return not log.is_dir() and log.suffix not in (".db3", ".bag")


class UnusableScenario(InvalidInput):
    """The file of criteria is wrong, whatever the log."""


@contextmanager
def _scenario_errors(criteria: LoadedCriteria) -> Iterator[None]:
    """What is wrong with the file of criteria, as UnusableScenario."""
    try:
        yield
    except InvalidInput as error:
        raise UnusableScenario(from_here(error.problems, criteria.library.fence.root)) from error


def runs_without_log(folders: Sequence[Path]) -> list[tuple[str, RunFinished]]:
    """The runs of output folders that left no log: a session must not look better judged than it was."""
    return [
        (str(run_folder(folder, answer.key)), _without_log(answer))
        for folder in folders
        if (folder / JOURNAL_FILE).is_file()
        for answer in read_journal(folder).answers
        if not any((run_folder(folder, answer.key) / log).exists() for log in (COMPLETE_LOG, PARTIAL_LOG))
    ]


def _without_log(answer: RunFinished) -> RunFinished:
    if answer.outcome is Outcome.SKIPPED:
        return answer
    error = answer.result.error
    failure = RunFailure(error.kind if error else "crashed", "it left no log" + (f": {error.message}" if error else ""))
    return RunFinished(error_result(answer.key, answer.result.path, failure), file=answer.file)
