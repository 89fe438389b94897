"""SessionFormatter, which formats the events of a session as console lines, and the lists at the end of a session."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from heapq import nsmallest

from simscen.core.records.run_result import INTERRUPTED, NONDETERMINISTIC, NOT_RUN, Outcome, RunKey
from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import (
    RunFinished,
    RunProgress,
    RunStarted,
    SessionEvent,
    SessionFinished,
    SessionStarted,
)
from simscen.report.comparison import comparison_lines
from simscen.report.display_text import Role, StyledLine, StyledText, number_with_noun, one_line, wrap_line
from simscen.report.session_lines import (
    SYMBOLS,
    RunNaming,
    artifact_lines,
    interruption_lines,
    run_lines,
    session_footer,
    session_header,
)
from simscen.report.study import study_lines
from simscen.report.violations import error_summary, first_violation


class SessionFormatter:
    """Formats the events of a session, in order, as console lines with styles.

    `slow` is the number of slowest runs to list at the end (0: all runs, None: no list). `columns` returns the current
    width of the terminal, or None for no limit.
    """

    def __init__(self, slow: int | None = None, columns: Callable[[], int | None] = lambda: None) -> None:
        self.naming = RunNaming()
        self._slow, self._columns = slow, columns
        self._runs = RunStore()
        self._printed_warnings: set[str] = set()

    def __call__(self, event: SessionEvent) -> list[StyledLine]:
        """Return the lines for an event, wrapped to the width of the terminal."""
        return [part for line in self._lines(event) for part in wrap_line(line, self._columns())]

    def _lines(self, event: SessionEvent) -> Iterator[StyledLine]:
        match event:
            case SessionStarted():
                self.naming = RunNaming.for_session(event, self._columns())
                yield session_header(event)
            case RunFinished():
                self._runs.append(event)
                if _error_kind(event) not in (INTERRUPTED, NOT_RUN):  # these runs are only counted at the end
                    yield from run_lines(event, self.naming)
                    for text in event.warnings:  # the external stack can repeat a warning in each run
                        if text not in self._printed_warnings:
                            self._printed_warnings.add(text)
                            yield (StyledText(f"      warning: {one_line(text)}", "warning"),)
            case SessionFinished():
                yield from self._final_lines(event)
            case RunStarted() | RunProgress():
                pass

    def _final_lines(self, event: SessionFinished) -> Iterator[StyledLine]:
        kinds = Counter(_error_kind(run) for run in self._runs)
        if event.interrupted:
            yield from interruption_lines(event, {"unfinished": kinds[INTERRUPTED], "not started": kinds[NOT_RUN]})
            return
        if event.comparison is not None:
            yield from comparison_lines(event.comparison, self.naming.prefix, self._columns())
        done = self._runs.select(index for index, run in enumerate(self._runs) if _error_kind(run) != NOT_RUN)
        slow = [] if self._slow is None else list(slowest_run_lines(done, self._slow, self._name))
        sections = [section for section in (slow, list(failure_lines(done, self._name))) if section]
        for section in sections:
            yield from ((), *section)
        if event.study is not None:
            yield from study_lines(event.study)
        yield from ((),) if sections or event.study is not None else ()
        yield from determinism_lines(done)
        yield from session_footer(event, {"not run": kinds[NOT_RUN]})

    def _name(self, key: RunKey) -> str:
        return self.naming.name(key).rstrip()


def _error_kind(run: RunFinished) -> str:
    """Return the kind of the error of a run; "" without an error."""
    return run.result.error.kind if run.result.error else ""


MAX_DETAILED_FAILURES = 20
"""Maximum number of failures that are listed with paths. Further failures are listed only with their cause."""

NameOfRun = Callable[[RunKey], str]
"""Function that returns the name of a run for a list of runs."""


def failure_lines(runs: Sequence[RunFinished], name: NameOfRun) -> Iterator[StyledLine]:
    """Yield each run that did not pass, with its first violation or error, artifacts, and repeat command.

    Yield nothing for a session with a single run. A run and its repetition by --check-determinism are listed once.
    """
    failed = {run.key for run in runs if not run.outcome.is_good}
    failures = [
        run for run in runs if run.key in failed and (run.key == run.key.original or run.key.original not in failed)
    ]
    if not failures or all(run.key.original == failures[0].key.original for run in runs):
        return
    yield (StyledText("did not pass:", "quiet"),)
    for number, run in enumerate(failures):
        symbol, _ = SYMBOLS[run.outcome]
        role: Role = "warning" if run.outcome is Outcome.ERROR else "bad"
        yield (StyledText("  "), StyledText(symbol, role), StyledText(f" {name(run.key)}", "name"))
        cause = error_summary(run) if run.outcome is Outcome.ERROR else first_violation(run) or "failed"
        yield (StyledText("      "), StyledText(cause, role))
        if number < MAX_DETAILED_FAILURES:
            yield from artifact_lines(run)


def slowest_run_lines(runs: Sequence[RunFinished], max_count: int, name: NameOfRun) -> Iterator[StyledLine]:
    """Yield the runs with the longest wall times, the longest first; `max_count` 0 lists all."""
    ordered = nsmallest(max_count or len(runs), (run for run in runs if run.wall), key=lambda run: (-run.wall, run.key))
    yield (StyledText("slowest:", "quiet"),)
    for run in ordered:
        wall = f"{run.wall:8.2f} s"
        simulated = f"   {run.result.simulated:.1f} s simulated"
        yield (StyledText(wall), StyledText(f"  {name(run.key)}", "name"), StyledText(simulated, "quiet"))


def determinism_lines(runs: Sequence[RunFinished]) -> Iterator[StyledLine]:
    """Yield lines that state whether runs and their repetitions by --check-determinism have equal logs.

    Yield nothing without repetitions or without logs.
    """
    if not any(run.key.is_repetition for run in runs):
        return
    first_runs = {run.key: run for run in runs if not run.key.is_repetition}
    pairs = [
        (first_runs[run.key.original], run) for run in runs if run.key.is_repetition and run.key.original in first_runs
    ]
    compared = [pair for pair in pairs if all(run.artifacts.mcap for run in pair)]
    if not compared:
        return
    differ = sum(any(_error_kind(run) == NONDETERMINISTIC for run in pair) for pair in compared)
    pairs_text = f"{number_with_noun(len(compared), 'pair')} of runs, byte for byte"
    if differ:
        yield (StyledText(f"logs differ: in {differ} of {pairs_text}", "warning"),)
        yield (StyledText(f"  {_difference_text(compared)}", "quiet"),)
    else:
        yield (StyledText(f"logs equal: {pairs_text}", "good"),)


def _difference_text(pairs: Sequence[tuple[RunFinished, RunFinished]]) -> str:
    """Return how many pairs have equal verdicts, and the largest differences of time to the goal and path length."""
    equal = sum(_statuses(first) == _statuses(second) for first, second in pairs)
    parts = [f"verdicts equal in {equal} of {len(pairs)}"]
    for metric, name, unit in (("time_to_goal", "time to goal", "s"), ("path_length", "path length", "m")):
        values = [(first.result.metrics.get(metric), second.result.metrics.get(metric)) for first, second in pairs]
        differences = [abs(a - b) for a, b in values if a is not None and b is not None]
        if differences:
            parts.append(f"{name} differs by up to {max(differences):.2f} {unit}")
    return ", ".join(parts)


def _statuses(run: RunFinished) -> list[tuple[str, str]]:
    return [(verdict.id, verdict.status.value) for verdict in run.result.verdicts]
