"""Console lines of a session: header, runs with their violations, and footer."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from simscen.core.records.run_result import REPEAT_SUFFIX, Outcome, RunKey
from simscen.core.records.session_events import RunFinished, SessionFinished, SessionStarted
from simscen.judge.finding_text import disturbance_line, tightest_margin
from simscen.report.display_text import Role, StyledLine, StyledText, number_with_noun, one_line, shell_command_text
from simscen.report.violations import (
    error_details,
    error_summary,
    failed_violations,
    reason_without_failure,
    reported_violations,
    scenario_file,
    short_run_name,
    source_location,
)

ERROR_TAIL_LINES = 12
"""Number of last lines of a worker's output that are printed below an error."""
FIXED_COLUMNS = 33
"""Width of the line of a run without its name. Names are padded to at most the remaining width of the terminal."""
MIN_NAME_COLUMNS = 16
"""Minimum width to which names are padded in a narrow terminal."""
MAX_DISTURBANCES = 8
"""Maximum number of disturbances that are listed below a run."""
SYMBOLS: dict[Outcome, tuple[str, Role]] = {
    Outcome.PASSED: ("✓", "good"),
    Outcome.FAILED: ("✗", "bad"),
    Outcome.ERROR: ("!", "warning"),
    Outcome.FAILED_AS_EXPECTED: ("~", "warning"),
    Outcome.SKIPPED: ("-", "warning"),
}
"""Symbol of each outcome, and the role of the symbol."""


@dataclass(frozen=True)
class RunNaming:
    """Rule for short unique names of runs.

    has_seeds:  whether names contain the seed
    prefix:     folder that is removed from the scenario ID
    width:      number of characters to which names are padded
    """

    has_seeds: bool = False
    prefix: str = ""
    width: int = 0

    @classmethod
    def for_session(cls, session: SessionStarted, columns: int | None = None) -> "RunNaming":
        """Return the rule for a session. Names contain the seed if the session has several seeds.

        `columns` is the width of the terminal; None for no limit.
        """
        stacks = [text.partition("=")[0] for text in session.stacks] if len(session.stacks) > 1 else []
        has_seeds = session.seeds > 1
        prefix = _common_folder(session.ids)
        longest = max((len(scenario_id) for scenario_id in session.ids), default=0) - len(prefix)
        stack = ".".join(
            part for part in (max(stacks, key=len, default=""), REPEAT_SUFFIX if session.twice else "") if part
        )
        extra = [*(["seed 1234"] if has_seeds else []), *([stack] if stack else [])]
        width = longest + (len(f" ({', '.join(extra)})") if extra else 0)
        available = width if columns is None else max(MIN_NAME_COLUMNS, columns - FIXED_COLUMNS)
        return cls(has_seeds, prefix, min(width, available))

    def name(self, key: RunKey) -> str:
        """Return the padded name of a run."""
        return f"{short_run_name(key, self.has_seeds, self.prefix):{self.width}}"


def _common_folder(ids: Sequence[str]) -> str:
    """Return the common folder of all scenario IDs with its slash, such as "scenarios/"; "" for fewer than two IDs."""
    if len(ids) < 2:
        return ""
    first, last = min(ids), max(ids)
    common_length = next((k for k, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), len(first))
    return first[: first.rfind("/", 0, common_length) + 1]


def session_header(started: SessionStarted) -> StyledLine:
    """Return the header, for example "simscen 0.1.0 · 14 scenarios · 2 workers"."""
    runs = "" if started.total == started.scenarios else f" · {number_with_noun(started.total, 'run')}"
    workers = number_with_noun(started.workers, "worker")
    head = f"simscen {started.version} · {number_with_noun(started.scenarios, 'scenario')}"
    if started.stacks:
        is_single = len(started.stacks) == 1
        head += f" · stack {one_line(started.stacks[0])}" if is_single else f" · {len(started.stacks)} stacks"
    return (StyledText(f"{head}{runs} · {workers}", "quiet"),)


def run_lines(run: RunFinished, naming: RunNaming) -> Iterator[StyledLine]:
    """Yield a line with the outcome of a run, then the lines of `violation_lines`."""
    symbol, role = SYMBOLS[run.outcome]
    yield (
        StyledText("  "),
        StyledText(symbol, role),
        StyledText(f" {naming.name(run.key)} ", "name"),
        *_times_and_reason(run),
    )
    yield from violation_lines(run)


def violation_lines(run: RunFinished) -> Iterator[StyledLine]:
    """Yield the violations, disturbances, artifacts, and repeat command of a run that did not pass.

    Yield only warnings for a passed run, and nothing for a skipped run or an expected failure.
    """
    if run.outcome in (Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED):
        return
    if run.outcome is Outcome.ERROR:
        yield from _error_lines(run)
    for violation in reported_violations(run):
        role: Role = "warning" if violation.is_warning or violation.verdict.status.value != "fail" else "bad"
        prefix = "warning: " if violation.is_warning else ""
        yield (StyledText("      "), StyledText(f"{prefix}{violation.message}", role))
        yield from (((StyledText(f"        {text}", "quiet")),) for text in violation.detail)
    if run.outcome is not Outcome.PASSED:
        yield from _disturbance_lines(run)
        line = next((violation.line for violation in failed_violations(run)), 0)
        yield (_label("scenario"), StyledText(source_location(run, line), file=scenario_file(run)))
        yield from artifact_lines(run)


def session_footer(session: SessionFinished, unfinished: Mapping[str, int]) -> Iterator[StyledLine]:
    """Yield a line such as "13 passed, 1 failed · 402 s simulated in 4.1 s · junit.xml", and the path of report.html.

    `unfinished` is as in `outcome_counts`.
    """
    yield (*outcome_counts(session, unfinished), *_timing_and_junit(session))
    if session.page:
        yield _page_link(session)


def interruption_lines(session: SessionFinished, unfinished: Mapping[str, int]) -> Iterator[StyledLine]:
    """Yield the last two lines of an interrupted session: outcomes, then the path of report.html and how to resume.

    `unfinished` is as in `outcome_counts`.
    """
    yield (StyledText("interrupted: ", "warning"), *outcome_counts(session, unfinished))
    page = _page_link(session) if session.page else ()
    resume = StyledText(f"{'   ' if page else ''}resume with --resume {one_line(session.folder)}", "quiet")
    yield (*page, *([resume] if session.folder and session.is_resumable else []))


def _page_link(session: SessionFinished) -> StyledLine:
    return StyledText("page: ", "quiet"), StyledText(one_line(session.page), file=session.page)


def outcome_counts(session: SessionFinished, unfinished: Mapping[str, int]) -> Iterator[StyledText]:
    """Yield the numbers of outcomes, for example "13 passed, 1 failed, 2 errors, 3 not run".

    `unfinished` maps a description such as "not run" to the number of these runs. `session.errors` includes these runs,
    but the yielded number of errors does not.
    """
    counts: list[tuple[int, str, Role]] = [
        (session.passed, "passed", "good"),
        (session.failed, "failed", "bad"),
        (session.errors - sum(unfinished.values()), "errors", "warning"),
        (session.expected, "failed as expected", "warning"),
        (session.skipped, "skipped", "warning"),
        *((number, word, "warning") for word, number in unfinished.items()),
    ]
    nonzero = [(number, word, role) for number, word, role in counts if number or word == "passed"]
    for index, (number, word, role) in enumerate(nonzero):
        if index:
            yield StyledText(", ")
        yield StyledText(f"{number} {'error' if word == 'errors' and number == 1 else word}", role)


def _timing_and_junit(session: SessionFinished) -> Iterator[StyledText]:
    """Yield the simulated and wall time of a session, and the path of junit.xml if it was written."""
    speed = f" ({session.simulated / session.wall:.0f}x)" if session.wall > 0 else ""
    yield StyledText(f" · {session.simulated:.0f} s simulated in {session.wall:.1f} s{speed}", "quiet")
    if session.junit:
        yield StyledText(" · ", "quiet")
        yield StyledText(one_line(session.junit), "quiet", file=session.junit)


def _times_and_reason(run: RunFinished) -> tuple[StyledText, ...]:
    """Return the times of a run, and the tightest margin of a passed run or the reason of an expected failure.

    For a skipped run, return only the reason. For an error before the simulation, return the kind and the wall time.
    """
    if run.outcome is Outcome.SKIPPED:
        return (StyledText(reason_without_failure(run), "quiet"),)
    if run.outcome is Outcome.ERROR and not run.result.simulated:
        return (StyledText(f"{error_details(run)[0]} after {run.wall:.2f} s", "quiet"),)
    times = f"{run.result.simulated:6.1f} s simulated in {run.wall:.2f} s{', kept' if run.resumed else ''}"
    if run.outcome is Outcome.FAILED_AS_EXPECTED:
        return (StyledText(f"{times}   {reason_without_failure(run)}", "quiet"),)
    tightest = tightest_margin(run.result.verdicts) if run.outcome is Outcome.PASSED else ""
    return (
        StyledText(times, "quiet"),
        *((StyledText(f"   tightest: {one_line(tightest)}", "quiet"),) if tightest else ()),
    )


def _error_lines(run: RunFinished) -> Iterator[StyledLine]:
    yield (StyledText("      "), StyledText(error_summary(run), "warning"))
    yield from (
        (StyledText(f"        | {line}", "quiet"),) for line in error_details(run)[2].splitlines()[-ERROR_TAIL_LINES:]
    )


def _disturbance_lines(run: RunFinished) -> Iterator[StyledLine]:
    """Yield at most MAX_DISTURBANCES of the disturbances that took place."""
    happened = [each for each in run.result.disturbances if each.happened]
    texts = [one_line(disturbance_line(each, run.result.tick_rate)) for each in happened]
    more = [f"and {len(texts) - MAX_DISTURBANCES} more"] if len(texts) > MAX_DISTURBANCES else []
    for number, text in enumerate((*texts[:MAX_DISTURBANCES], *more)):
        yield (StyledText(f"      {'' if number else 'happened':9} ", "quiet"), StyledText(text))


def artifact_lines(run: RunFinished) -> Iterator[StyledLine]:
    """Yield the paths of replay and picture, and the command to repeat the run. Without a picture, yield the log."""
    files = run.artifacts
    paths = [("replay", files.replay), ("picture", files.picture)] if files.picture else [("log", files.mcap)]
    for name, path in paths:
        if path:
            yield (_label(name), StyledText(one_line(path), file=path))
    if run.again:
        yield (_label("again"), StyledText(shell_command_text(run.again), is_shell=True))


def _label(name: str) -> StyledText:
    return StyledText(f"      {name:9} ", "quiet")
