"""Implementation of `simscen study`, which runs one scenario many times to measure or test its pass rate.

A claim is a pass rate to be tested. A sequential claim is evaluated repeatedly during the study.
"""

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from simscen.cli.diagnostics import as_text, escaped, paths_from_working_folder, print_text
from simscen.cli.session.backends import backend_of, interrupt_on_signals
from simscen.cli.session.exit_codes import exit_code
from simscen.cli.session.live_page import LivePage
from simscen.cli.session.output_files import Reports
from simscen.cli.session.pending_runs import (
    divide_runs,
    plan_runs,
    previous_session,
    reusable_results,
    warn_of_dropped_runs,
    write_reused,
)
from simscen.cli.session.scenario_session import finish_session, plugins_and_stacks, start_session
from simscen.cli.session.selection import Selection, load_selection
from simscen.cli.session.terminal import open_screen
from simscen.cli.shared_options import OutputOptions
from simscen.core.errors import Exit, InvalidInput, NothingSelected, Problem, SimscenError, UsageError
from simscen.core.random_streams import MAX_SEED
from simscen.core.records.run_result import scenario_title
from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import Listener, RunFinished, SessionStarted, broadcast
from simscen.core.records.study import ClaimStatus
from simscen.core.version import __version__
from simscen.judge.pass_rate_claims import evaluate_claim
from simscen.judge.study import StudyPlan, evaluate_study, in_seed_order
from simscen.loading.files.discovery import default_root
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import read_variation_space
from simscen.loading.variations.conditions import ConditionError
from simscen.loading.variations.expand import VariationSpace
from simscen.loading.variations.naming import number_of
from simscen.model.acceptance import PassRate
from simscen.report.journal import Journal
from simscen.report.journal_reader import PlannedRun
from simscen.run.process.jobs import Backend, Job
from simscen.run.process.supervisor import Interrupted
from simscen.run.sessions.run_session import SessionOptions, run_session

SEQUENTIAL_BATCH_SIZE = 32
"""Number of runs between two evaluations of a sequential claim. The study ends as soon as the claim is decided."""
BATCH_SIZE = 256
"""Number of runs per batch of a study without a sequential claim. It limits the number of scenarios in memory."""


@dataclass(frozen=True)
class StudyRequest:
    """Arguments of `simscen study` by name. `options` contains the options for the runs."""

    file: Path
    runs: int | None
    repeat: int
    options: SessionOptions
    root: Path | None
    world_path: Sequence[Path]
    lenient: bool
    stack: str | None
    output: OutputOptions


class StudyRun(NamedTuple):
    """Run of a study.

    number:      number of the variation; None for a scenario without variations
    seed_index:  seed of the run minus the first seed of the study
    draw_count:  number of random variations drawn up to this run, including rejected ones; 0 without conditions
    """

    number: int | None
    seed_index: int
    draw_count: int


def execute_study(request: StudyRequest) -> Exit:
    """Run a study, write its reports, and return the exit code.

    Raises InvalidInput, UsageError, and NothingSelected.
    """
    study = _StudySession(request)
    first = study.load_first_batch()
    reports, journal = start_session(request.output, study.inputs, plugins_and_stacks(first))
    with open_screen(request.output.format_) as screen, backend_of(request.options) as backend:
        live = [LivePage(reports)] if request.output.open_ else []
        return screen.exit_code(study.execute(backend, journal, reports, broadcast(screen, *live)))


class _StudySession:
    """Session of a study. Runs are chosen, loaded, and executed in batches."""

    def __init__(self, request: StudyRequest) -> None:
        self._request = request
        self._root_folder = request.root or default_root([request.file])
        with paths_from_working_folder(self._root_folder):
            space = read_variation_space(request.file, self._root_folder, request.world_path)
        self._space = space if space is not None and space.blocks else None
        self._is_random = self._space is None or self._space.is_random
        self._loaded: dict[int | None, LoadedScenario] = {}
        self._scenario_text = ""
        self._claim: PassRate | None = None
        self._runs: Iterator[StudyRun] = iter(())
        self._batch: list[StudyRun] = []
        self._planned: list[PlannedRun] = []
        self._draw_count = 0
        self.total = 0
        self.inputs: set[Path] = set()

    def load_first_batch(self) -> list[LoadedScenario]:
        """Determine the number of runs, and return the scenarios of the first batch.

        Raises InvalidInput, UsageError, and NothingSelected.
        """
        request = self._request
        first_number = None if self._space is None else next(_allowed_numbers(self._space, request.file))
        scenario = self._load([first_number])[0]
        acceptance = scenario.spec.acceptance
        if scenario.spec.skip is not None:
            raise NothingSelected(f"{scenario.title} is marked with `skip`: {escaped(scenario.spec.skip)}")
        if acceptance is not None:
            claim = acceptance.pass_rate
            self._claim = claim if request.runs is None else claim.model_copy(update={"runs": request.runs})
        self.total = self._count_runs()
        self._base_seed = request.options.seed if request.options.seed is not None else scenario.spec.seed
        seeds = self.total if self._is_random else request.repeat
        if self._base_seed + seeds - 1 > MAX_SEED:
            raise UsageError(f"{seeds} runs from seed {self._base_seed} on exceed the largest seed, {MAX_SEED}")
        self._runs = islice(self._all_runs(), self.total)
        self._batch = list(islice(self._runs, self._batch_size))
        return self._load([run.number for run in self._batch])

    def execute(self, backend: Backend, journal: Journal, reports: Reports, listener: Listener) -> Exit:
        """Run batches until the claim is decided or all runs are done, write the reports, and return the exit code.

        `listener` receives all events. If a later run cannot be loaded, the error is raised after the reports are
        written.
        """
        start, finished_runs, stopped = time.monotonic(), RunStore(), None
        error: SimscenError | None = None
        past = previous_session(journal)
        earlier = reusable_results(past)
        scenario_id = next(iter(self._loaded.values())).id
        longest_title = scenario_id if self._space is None else scenario_title(scenario_id, f"variation-{self.total}")

        journal_and_listener = broadcast(journal, listener)
        workers = self._request.options.workers
        titles = (longest_title,)
        listener(SessionStarted(__version__, self.total, 1, workers, str(reports.folder), titles, seeds=self.total))
        while self._batch and stopped is None:
            jobs = self._jobs(len(finished_runs), reports.folder)
            remaining, reused = self._plan(journal, jobs, earlier)
            write_reused(journal, reused)
            for finished in reused:
                listener(finished)
            with interrupt_on_signals():
                done, stopped = run_session(remaining, self._request.options, backend, journal_and_listener)
            journal.complete([*reused, *done])
            finished_runs.extend([*reused, *done])
            if stopped is not None or self._is_decided(finished_runs):
                break
            try:
                with interrupt_on_signals():
                    self._batch = list(islice(self._runs, self._batch_size))
                    self._load([run.number for run in self._batch])
            except Interrupted as interrupted:
                stopped = Exit(128 + interrupted.number)
            except SimscenError as raised:
                error = raised
                break
        if stopped is None:
            warn_of_dropped_runs(journal.folder, past, self._planned)
        study = evaluate_study(self._study_plan(), (finished.result for finished in finished_runs))
        written = finish_session(
            reports, journal, journal_and_listener, finished_runs, start, stopped is not None, study=study
        )
        if error is not None:
            raise error
        return stopped or (exit_code(finished_runs, study) if written else Exit.INCOMPLETE)

    @property
    def _batch_size(self) -> int:
        return BATCH_SIZE if self._claim is None or self._claim.method == "fixed" else SEQUENTIAL_BATCH_SIZE

    def _count_runs(self) -> int:
        """Return the number of runs; for a sequential claim, the maximum number. Raises UsageError."""
        request, space = self._request, self._space
        if not self._is_random:
            assert space is not None
            if request.runs is not None:
                raise UsageError("--runs is for random seeds and values; these variations are run --repeat times each")
            return request.repeat * sum(1 for _ in _allowed_numbers(space, self._request.file))
        if request.repeat != 1:
            raise UsageError("--repeat is for chosen values; set the number of random runs with --runs")
        if self._claim is not None:
            return self._claim.max_runs
        if request.runs is not None:
            return request.runs
        if space is not None:
            return space.count
        raise UsageError("the number of runs is missing; set it with --runs, or with `acceptance` in the scenario")

    def _all_runs(self) -> Iterator[StudyRun]:
        """Yield the runs in order. Random runs have different seeds; other variations all have the same seeds."""
        space = self._space
        if space is None:
            yield from (StudyRun(None, index, 0) for index in range(self.total))
        elif self._is_random:
            numbers = _allowed_numbers(space, self._request.file)
            has_conditions = bool(space.blocks[0].conditions)
            yield from (StudyRun(n, index, n if has_conditions else 0) for index, n in enumerate(numbers))
        else:
            for number in _allowed_numbers(space, self._request.file):
                yield from (StudyRun(number, index, 0) for index in range(self._request.repeat))

    def _load(self, numbers: Sequence[int | None]) -> list[LoadedScenario]:
        """Return the loaded variations with these numbers, in this order. Raises InvalidInput and UsageError."""
        request = self._request
        names = [f"variation-{number}" for number in dict.fromkeys(numbers) if number is not None]
        missing = [number for number in dict.fromkeys(numbers) if number not in self._loaded]
        if missing:
            found, warnings = load_selection(
                [request.file],
                request.root,
                request.world_path,
                request.lenient,
                Selection(variations=names),
                [] if request.stack is None else [request.stack],
            )
            if warnings and not self._scenario_text:
                print_text(as_text(warnings), sys.stderr)
            if self._scenario_text not in ("", found[0].text):
                raise UsageError(f"{request.file} has changed since the study began")
            self._scenario_text = found[0].text
            self._loaded = {number_of(each.variation) if each.variation else None: each for each in found}
            self.inputs |= {file for each in found for file in (*each.files.values(), *each.read_files)}
        return [self._loaded[number] for number in numbers]

    def _jobs(self, first_number: int, folder: Path) -> list[Job]:
        """Return the jobs of the current batch. `first_number` is the number of the first job."""
        options, jobs = self._request.options, []
        for index, run in enumerate(self._batch):
            scenario = self._loaded[run.number]
            key = scenario.key(self._base_seed + run.seed_index)
            jobs.append(options.job(first_number + index, scenario, key, folder))
        return jobs

    def _plan(
        self, journal: Journal, jobs: Sequence[Job], earlier_results: Mapping[PlannedRun, RunFinished]
    ) -> tuple[list[Job], list[RunFinished]]:
        """Write the runs of a batch to the journal, and return the jobs to execute, and the reused results."""
        planned = plan_runs(jobs)
        remaining, reused = divide_runs(jobs, planned, earlier_results)
        self._planned += planned
        self._draw_count = self._batch[-1].draw_count
        journal.add(planned, __version__, self._request.options.workers, self._study_plan())
        return remaining, reused

    def _study_plan(self) -> StudyPlan:
        values = {run.key: run.varied for run in self._planned if run.varied}
        scenario = next(iter(self._loaded.values())).id
        is_pairwise = self._space is not None and any(block.is_pairwise for block in self._space.blocks)
        return StudyPlan(scenario, self._is_random, self._claim, values, is_pairwise, self._draw_count)

    def _is_decided(self, finished_runs: Sequence[RunFinished]) -> bool:
        """Return whether these runs decide a sequential claim."""
        if self._claim is None or self._claim.method == "fixed":
            return False
        claim = evaluate_claim(self._claim, in_seed_order(finished.result for finished in finished_runs))
        return claim.status is not ClaimStatus.UNDECIDED


def _allowed_numbers(space: VariationSpace, file: Path) -> Iterator[int]:
    """Yield the numbers of the variations that meet the conditions in `require`; endlessly for random variations.

    Raises InvalidInput if no variation meets the conditions, or none of MAX_REJECTED_DRAWS consecutive draws.
    """
    number = 0
    try:
        for number in space.numbers():
            yield number
        if not number:
            raise ConditionError("no variation meets the conditions in `require`")
    except ConditionError as error:
        raise InvalidInput([Problem(str(file), 0, 0, "SC016", str(error))]) from error
