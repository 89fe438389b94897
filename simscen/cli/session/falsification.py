"""Implementation of `simscen falsify`, which searches for values in given ranges with which a scenario fails."""

import math
import shlex
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from simscen.cli.diagnostics import escaped, paths_from_working_folder, relative_to_working_folder
from simscen.cli.session.backends import backend_of, interrupt_on_signals
from simscen.cli.session.file_checks import FileChecker
from simscen.cli.session.output_files import Reports, require_writable_junit
from simscen.cli.session.pending_runs import plan_runs
from simscen.cli.session.scenario_session import finish_session, plugins_and_stacks, start_session
from simscen.cli.session.stacks import parse_stacks
from simscen.cli.session.terminal import Screen, open_screen
from simscen.cli.session.user_files import require_writable
from simscen.cli.shared_options import OutputOptions
from simscen.core.errors import Exit, InvalidInput, NothingSelected, Problem, SimscenError, UsageError
from simscen.core.records.run_result import PROPOSAL_PREFIX, Outcome, RunResult
from simscen.core.records.session_events import RunFinished, SessionStarted, broadcast
from simscen.core.records.verdict import Status
from simscen.core.version import __version__
from simscen.judge.finding_text import run_margin
from simscen.judge.pass_rate_claims import clopper_pearson_limits, is_counted
from simscen.judge.study import StudyPlan, evaluate_study, value_text
from simscen.loading.files.discovery import default_root, sibling
from simscen.loading.loaded import LoadedScenario
from simscen.loading.reduction import with_seed
from simscen.loading.scenario import ChangedScenario
from simscen.loading.variations.conditions import ConditionError
from simscen.loading.variations.expand import Variation
from simscen.loading.variations.search_space import SearchSpace, search_space
from simscen.loading.yaml.tree import MappingNode, child
from simscen.report.display_text import number_with_noun
from simscen.report.journal import Journal
from simscen.report.journal_reader import PlannedRun
from simscen.run.process.jobs import Backend, Job
from simscen.run.process.supervisor import Interrupted
from simscen.run.sessions.output_folder import write_atomically
from simscen.run.sessions.results import display_path
from simscen.run.sessions.run_session import SessionOptions, run_session
from simscen.run.sessions.search import Point, Search, SearchMethod, make_search

BATCH_SIZE = 8
"""Number of runs between two updates of the search method."""
MAX_EMPTY_BATCHES = 50
"""Number of consecutive batches without valid values after which the search ends."""
SQUARE_SIZE_M = 1.0
"""Side of the grid squares by which failures at different positions are distinguished."""
CONFIDENCE = 0.95
"""Confidence of the upper bound of the failure rate."""


@dataclass(frozen=True)
class FalsifyRequest:
    """Arguments of `simscen falsify` by name. `options` contains the options for the runs."""

    file: Path
    method: SearchMethod
    failures: int
    runs: int
    probability: float | None
    search_seed: int
    options: SessionOptions
    root: Path | None
    world_path: Sequence[Path]
    lenient: bool
    stack: str | None
    output: OutputOptions


@dataclass(frozen=True)
class FoundFailure:
    """Failure that differs from all failures found before.

    file:    scenario file that reproduces the failure
    run:     failed run
    values:  values of the varied keys, by path in the scenario
    """

    file: Path
    run: RunFinished
    values: dict[str, object]


Signature = tuple[tuple[str, ...], frozenset[str], tuple[int, int] | None]
"""IDs of the failed criteria, names of the triggered disturbances, and index (x, y) of the grid square of the failure.

Failures with equal signatures count as the same failure. A failure without a failed criterion has the kind of its error
instead of the IDs. The square is None for a failure without a position.
"""


def execute_search(request: FalsifyRequest) -> tuple[Exit, "Falsification"]:
    """Run a search, write its reports and the failing scenarios, and return the exit code and the search.

    Raises InvalidInput, UsageError, and NothingSelected.
    """
    falsification = Falsification(request)
    require_writable(_new_failure_file(request.file))
    reports, journal = start_session(request.output, [request.file], is_resumable=False)
    with open_screen(request.output.format_) as screen, backend_of(request.options) as backend:
        return screen.exit_code(falsification.execute(backend, journal, reports, screen)), falsification


class Falsification:
    """Search that runs a scenario with proposed values, and writes a scenario file for each distinct failure."""

    def __init__(self, request: FalsifyRequest) -> None:
        """Read the scenario and its ranges. Raises InvalidInput, UsageError, and NothingSelected."""
        self._request = request
        root = request.root or default_root([request.file])
        stacks = parse_stacks([] if request.stack is None else [request.stack], root, request.world_path)
        choice = next(iter(stacks.choices), None)
        with paths_from_working_folder(root):
            self._scenario = ChangedScenario(request.file, root, request.world_path, choice, None)
            space = search_space(self._scenario.merged_tree)
            if not isinstance(space, SearchSpace):
                raise InvalidInput(space)
        _require_unmarked(self._scenario.merged_tree, request.file)
        self._root, self._space = root, space
        self._checker = FileChecker(root, request.world_path, request.lenient, stacks=stacks)
        self._search: Search = make_search(request.method, space.choice_counts, request.search_seed)
        self._variations: dict[str, Variation] = {}
        self._planned: list[PlannedRun] = []
        self._signatures: set[Signature] = set()
        self._proposal_count = 0
        self._problems: list[Problem] = []  # of the last values with which the scenario is invalid
        self.finished_runs: list[RunFinished] = []
        self.failures: list[FoundFailure] = []

    def execute(self, backend: Backend, journal: Journal, reports: Reports, screen: Screen) -> Exit:
        """Search until a limit of the request is reached, or no valid values are found. Return the exit code.

        An error of proposed values, such as InvalidInput, is raised after the reports are written.
        """
        start, stopped, empty_batches = time.monotonic(), None, 0
        error: SimscenError | None = None
        listener = broadcast(journal, screen)
        workers = self._request.options.workers
        runs = self._request.runs
        screen(SessionStarted(__version__, runs, 1, workers, str(reports.folder), seeds=runs))
        while stopped is None and not self._is_done() and empty_batches < MAX_EMPTY_BATCHES:
            points = self._search.ask(min(BATCH_SIZE, self._request.runs - len(self.finished_runs)))
            try:
                with interrupt_on_signals():
                    jobs = self._make_jobs(points, reports.folder)
            except Interrupted as interrupted:
                stopped = Exit(128 + interrupted.number)
                break
            except SimscenError as raised:
                error = raised
                break
            valid = [job for job in jobs if job is not None]
            empty_batches = 0 if valid else empty_batches + 1
            self._plan(journal, valid)
            if not self.finished_runs:
                reports.add_entries(plugins_and_stacks([job.scenario for job in valid]))
            with interrupt_on_signals():
                finished_runs, stopped = run_session(valid, self._request.options, backend, listener)
            by_key = {finished.key: finished for finished in finished_runs}
            ordered = [None if job is None else by_key[job.key] for job in jobs]
            self.finished_runs += [finished for finished in ordered if finished is not None]
            self._search.tell([_margin(finished) for finished in ordered])
            for finished in ordered:
                if finished is not None and stopped is None:
                    self._save_failure(finished)
        if not self.finished_runs and stopped is None:
            message = f"none of {self._proposal_count} proposed values meets the conditions in `require`"
            problems = relative_to_working_folder(self._problems, self._root)
            raise error or InvalidInput(problems or [Problem(str(self._request.file), 0, 0, "SC016", message)])
        study = evaluate_study(self._study_plan(), (finished.result for finished in self.finished_runs))
        is_interrupted = stopped is not None
        written = finish_session(reports, journal, listener, self.finished_runs, start, is_interrupted, study=study)
        if error is not None:
            raise error
        if stopped is not None or not written:
            return stopped or Exit.INCOMPLETE
        if study.errors:
            return Exit.INCOMPLETE
        if self.failures:
            return Exit.FAILED
        return Exit.PASSED if self.is_probability_shown else Exit.UNDECIDED

    @property
    def is_random(self) -> bool:
        """Whether the runs are independent random draws."""
        return self._request.method is SearchMethod.RANDOM

    @property
    def is_probability_shown(self) -> bool:
        """Whether the runs show that the failure rate is at most --probability; True without this option."""
        probability, largest = self._request.probability, self.max_failure_rate()
        return probability is None or (largest is not None and largest <= probability)

    def max_failure_rate(self) -> float | None:
        """Return the upper confidence bound of the failure rate; None if no random run has been completed."""
        counted = [finished for finished in self.finished_runs if is_counted(finished.result)]
        if not self.is_random or not counted:
            return None
        passed = sum(finished.outcome is Outcome.PASSED for finished in counted)
        return 1.0 - clopper_pearson_limits(passed, len(counted), CONFIDENCE)[0]

    def _is_done(self) -> bool:
        """Return whether one of the limits in the request is reached: failures, runs, or probability."""
        request = self._request
        if len(self.failures) >= request.failures or len(self.finished_runs) >= request.runs:
            return True
        return request.probability is not None and self.is_probability_shown

    def _make_jobs(self, points: Sequence[Point], folder: Path) -> list[Job | None]:
        """Return a job for each point (proposed values); None for values with which the scenario is invalid."""
        jobs: list[Job | None] = []
        options = self._request.options
        for point in points:
            self._proposal_count += 1
            scenario = self._load(f"{PROPOSAL_PREFIX}{self._proposal_count}", point)
            if scenario is None:
                jobs.append(None)
                continue
            key = scenario.key(options.seed if options.seed is not None else scenario.spec.seed)
            jobs.append(options.job(len(jobs), scenario, key, folder))
        return jobs

    def _load(self, name: str, point: Point) -> LoadedScenario | None:
        """Return the scenario with the values of a point, as variation `name`; None for an invalid scenario."""
        try:
            variation = self._space.variation(name, point)
        except ConditionError as error:
            raise InvalidInput([Problem(str(self._request.file), 0, 0, "SC016", str(error))]) from error
        if variation is None:
            return None
        self._variations[name] = variation
        loaded = self._scenario.load(variation.tree)
        if isinstance(loaded, list):
            self._problems = loaded
            return None
        checked, problems = self._checker.check_variation(
            loaded.with_changes(variation=name, varied_values=variation.values)
        )
        if checked is None:
            self._problems = problems
            return None
        output = self._request.output
        require_writable_junit(output.junit, output.out, (*checked.files.values(), *checked.read_files))
        return checked

    def _plan(self, journal: Journal, jobs: Sequence[Job]) -> None:
        """Write the planned runs of a batch to the journal."""
        planned = plan_runs(jobs)
        self._planned += planned
        journal.add(planned, __version__, self._request.options.workers, self._study_plan())

    def _study_plan(self) -> StudyPlan:
        """Return the plan of the search in the form of a study, for the journal and the reports."""
        values = {run.key: run.varied for run in self._planned if run.varied}
        name = self._planned[0].key.scenario if self._planned else self._request.file.stem
        return StudyPlan(name, self.is_random, None, values, stops_early=True)

    def _save_failure(self, finished: RunFinished) -> None:
        """Write a scenario that reproduces the run, if it failed with a new signature and more failures are wanted."""
        result = finished.result
        if result.outcome.is_good or not is_counted(result) or len(self.failures) >= self._request.failures:
            return
        if (new := signature(result)) in self._signatures:
            return
        self._signatures.add(new)
        variation = self._variations[result.key.variation]
        tree = with_seed(variation.tree, result.key.seed)
        comment = f"Found by simscen falsify: {self._request.file.name} fails with these values."
        file = _new_failure_file(self._request.file)
        text = self._scenario.text_in(file.parent, tree, comment)
        write_atomically(file, text.encode())
        self.failures.append(FoundFailure(file, finished, variation.values))


def _require_unmarked(scenario: MappingNode, file: Path) -> None:
    """Raise NothingSelected if the scenario is marked with `skip`, and UsageError if it is marked with `expected`."""
    skip, expected = (child(scenario, key) for key in ("skip", "expected"))
    if skip is not None and skip.plain is not None:
        raise NothingSelected(f"{file} is marked with `skip`: {escaped(str(skip.plain))}")
    if expected is not None and expected.plain is not None:
        raise UsageError(f"{file} is marked with `expected`; remove it to search for failures")


def _new_failure_file(scenario: Path) -> Path:
    """Return the first path NAME.failure-N.scenario.yaml beside the scenario that does not exist."""
    return next(file for k in count(1) if not (file := sibling(scenario, f"failure-{k}")).exists())


def signature(result: RunResult) -> Signature:
    """Return the signature of a failed run."""
    failed = [verdict for verdict in result.verdicts if verdict.status is Status.FAIL]
    finding = failed[0].tightest if failed else None
    place = None if finding is None else finding.place
    square = None if place is None else (math.floor(place[0] / SQUARE_SIZE_M), math.floor(place[1] / SQUARE_SIZE_M))
    ids = tuple(sorted({verdict.id for verdict in failed})) or ((result.error.kind,) if result.error else ())
    triggered = frozenset(disturbance.disturbance.name for disturbance in result.disturbances if disturbance.fired)
    return ids, triggered, square


def summary_lines(falsification: Falsification) -> list[str]:
    """Return the last lines of the output: the failures, or a statement that there was no failure."""
    runs = number_with_noun(sum(is_counted(finished.result) for finished in falsification.finished_runs), "run")
    lines = []
    for failure in falsification.failures:
        values = ", ".join(f"{path} = {value_text(value)}" for path, value in failure.values.items())
        lines += [f"failure: {display_path(failure.file)}", f"with {values}"]
        lines += [f"replay: {failure.run.artifacts.replay}"] if failure.run.artifacts.replay else []
        lines += [f"smaller: simscen shrink {shlex.quote(display_path(failure.file))}", ""]
    number = len(falsification.failures)
    if number:
        lines.append(f"found {number} {'failure' if number == 1 else 'different failures'} in {runs}")
        return lines
    lines.append(f"found no failure in {runs}")
    largest = falsification.max_failure_rate()
    if largest is not None:
        lines.append(f"with {CONFIDENCE:.0%} confidence, at most {100 * largest:.3g} % of random values fail")
    if not falsification.is_probability_shown:
        lines.append("undecided: too few runs for --probability; increase --runs")
    return lines


def _margin(finished: RunFinished | None) -> float:
    """Return the smallest relative margin of a run, negative for a failure; NaN without a run and after an error."""
    return math.nan if finished is None or not is_counted(finished.result) else run_margin(finished.result)
