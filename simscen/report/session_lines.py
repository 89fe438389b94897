"""A session as lines of text: what the console prints, piece by piece with the role of each piece."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from simscen.core.records.run_result import REPEAT_SUFFIX, Outcome, RunKey
from simscen.core.records.session_events import RunFinished, SessionFinished, SessionStarted
from simscen.judge.finding_text import disturbance_line, tightest_margin
from simscen.report.display_text import one_line, shell_command_text
from simscen.report.styled_line import Role, StyledLine, StyledText
from simscen.report.violations import (
    error_details,
    error_summary,
    excuse_text,
    reported_violations,
    scenario_file,
    short_run_name,
    source_location,
)

ERROR_TAIL_LINES = 12
FIXED_COLUMNS = 33
"""Columns that sign and times take, so that names are padded to what is left of a terminal's."""
MIN_NAME_COLUMNS = 16
MAX_DISTURBANCES = 8
SIGNS = {
    Outcome.PASSED: ("✓", "good"),
    Outcome.FAILED: ("✗", "bad"),
    Outcome.ERROR: ("!", "odd"),
    Outcome.FAILED_AS_EXPECTED: ("~", "odd"),
    Outcome.SKIPPED: ("-", "odd"),
}


@dataclass(frozen=True)
class RunNaming:
    """How runs are called in the lines of a session: short, unique, and in a column of `width`.

    `columns` are those of the terminal; None where there is none.
    """

    every_seed: bool = False
    prefix: str = ""
    width: int = 0
    columns: int | None = None

    @classmethod
    def of(cls, session: SessionStarted, columns: int | None = None) -> "RunNaming":
        """Seeds are told where a scenario runs more than once with a stack, stacks where there are several."""
        stacks = [text.partition("=")[0] for text in session.stacks] if len(session.stacks) > 1 else []
        every_seed = session.total != (len(session.ids) or session.scenarios) * max(1, len(stacks))
        prefix = _common_folder(session.ids)
        longest = max((len(one) for one in session.ids), default=0) - len(prefix)
        stack = ".".join(
            part for part in (max(stacks, key=len, default=""), REPEAT_SUFFIX if session.twice else "") if part
        )
        extra = [*(["seed 1234"] if every_seed else []), *([stack] if stack else [])]
        width = longest + (len(f" ({', '.join(extra)})") if extra else 0)
        room = width if columns is None else max(MIN_NAME_COLUMNS, columns - FIXED_COLUMNS)
        return cls(every_seed, prefix, min(width, room), columns)

    def name(self, key: RunKey) -> str:
        """The run's name, padded."""
        return f"{short_run_name(key, self.every_seed, self.prefix):{self.width}}"


def _common_folder(ids: Sequence[str]) -> str:
    """The folder that all ids begin with, with its slash: "scenarios/"; "" for a single one or none."""
    if len(ids) < 2:
        return ""
    shortest, longest = min(ids), max(ids)
    same = next((k for k, (a, b) in enumerate(zip(shortest, longest, strict=False)) if a != b), len(shortest))
    return shortest[: shortest.rfind("/", 0, same) + 1]


def session_header(started: SessionStarted) -> StyledLine:
    """simscen 0.1.0 · 14 scenarios · 2 workers."""
    runs = "" if started.total == started.scenarios else f" · {_count(started.total, 'run')}"
    workers = _count(started.workers, "worker")
    head = f"simscen {started.version} · {_count(started.scenarios, 'scenario')}{_stacks_text(started.stacks)}"
    return (StyledText(f"{head}{runs} · {workers}", "quiet"),)


def _stacks_text(stacks: Sequence[str]) -> str:
    """The one stack that takes the place of the scenarios' own, or how many."""
    disturbance_line = f"stack {one_line(stacks[0])}" if len(stacks) == 1 else f"{len(stacks)} stacks"
    return f" · {disturbance_line}" if stacks else ""


def run_lines(run: RunFinished, naming: RunNaming) -> Iterator[StyledLine]:
    """One line for a run that passed; for the others also what was violated, where, and how to see it again."""
    sign, role = SIGNS[run.outcome]
    yield (
        StyledText("  "),
        StyledText(sign, _role(role)),
        StyledText(f" {naming.name(run.key)} ", "name"),
        *_summary(run),
    )
    yield from violation_lines(run)


def violation_lines(run: RunFinished) -> Iterator[StyledLine]:
    """What was violated, where, and how to see it again; nothing but warnings for a run that passed.

    Of one that failed as expected only the reason is of interest, which stands beside its name.
    """
    if run.outcome in (Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED):
        return
    if run.outcome is Outcome.ERROR:
        yield from _error_lines(run)
    for complaint in reported_violations(run):
        role = "odd" if complaint.warning or complaint.verdict.status.value != "fail" else "bad"
        word = "warning: " if complaint.warning else ""
        yield (StyledText("      "), StyledText(f"{word}{complaint.message}", _role(role)))
        yield from (((StyledText(f"        {text}", "quiet")),) for text in complaint.detail)
    if run.outcome is not Outcome.PASSED:
        yield from _disturbance_lines(run)
        yield _scenario_line(run)
        yield from artifact_lines(run)


def session_footer(session: SessionFinished, left: Mapping[str, int]) -> Iterator[StyledLine]:
    """13 passed, 1 failed · 402 s simulated in 4.1 s · simscen-out/latest/junit.xml; then the page to open.

    `left` are runs that were not done, by what to say of them.
    """
    yield (*outcome_counts(session, left), *_timing_and_junit(session))
    if session.page:
        yield (StyledText("page: ", "quiet"), StyledText(one_line(session.page), file=session.page))


def outcome_counts(session: SessionFinished, left: Mapping[str, int]) -> Iterator[StyledText]:
    """13 passed, 1 failed, 2 errors, 3 not run: what is `left` counts as an error in the reports, but not to people."""
    counts = [
        (session.passed, "passed", "good"),
        (session.failed, "failed", "bad"),
        (session.errors - sum(left.values()), "errors", "odd"),
        (session.expected, "failed as expected", "odd"),
        (session.skipped, "skipped", "odd"),
        *((number, word, "odd") for word, number in left.items()),
    ]
    shown = [(number, word, role) for number, word, role in counts if number or word == "passed"]
    for nth, (number, word, role) in enumerate(shown):
        if nth:
            yield StyledText(", ")
        yield StyledText(f"{number} {'error' if word == 'errors' and number == 1 else word}", _role(role))


def _timing_and_junit(session: SessionFinished) -> Iterator[StyledText]:
    speed = f" ({session.simulated / session.wall:.0f}x)" if session.wall > 0 else ""
    yield StyledText(f" · {session.simulated:.0f} s simulated in {session.wall:.1f} s{speed}", "quiet")
    if session.junit:
        yield StyledText(" · ", "quiet")
        yield StyledText(one_line(session.junit), "quiet", file=session.junit)


def _summary(run: RunFinished) -> tuple[StyledText, ...]:
    if run.outcome is Outcome.SKIPPED:
        return (StyledText(excuse_text(run), "quiet"),)
    if run.outcome is Outcome.ERROR and not run.result.simulated:
        return (StyledText(f"{error_details(run)[0]} after {run.wall:.2f} s", "quiet"),)
    times = f"{run.result.simulated:6.1f} s simulated in {run.wall:.2f} s{', kept' if run.resumed else ''}"
    if run.outcome is Outcome.FAILED_AS_EXPECTED:
        return (StyledText(f"{times}   {excuse_text(run)}", "quiet"),)
    nearest = tightest_margin(run.result.verdicts) if run.outcome is Outcome.PASSED else ""
    return (
        StyledText(times, "quiet"),
        *((StyledText(f"   tightest: {one_line(nearest)}", "quiet"),) if nearest else ()),
    )


def _error_lines(run: RunFinished) -> Iterator[StyledLine]:
    yield (StyledText("      "), StyledText(error_summary(run), "odd"))
    yield from (
        (StyledText(f"        | {line}", "quiet"),) for line in error_details(run)[2].splitlines()[-ERROR_TAIL_LINES:]
    )


def _disturbance_lines(run: RunFinished) -> Iterator[StyledLine]:
    """What fired and when; what did not is among the complaints, or may stay away."""
    fired = [one_line(disturbance_line(one, run.result.tick_rate)) for one in run.result.disturbances if one.happened]
    more = [f"and {len(fired) - MAX_DISTURBANCES} more"] if len(fired) > MAX_DISTURBANCES else []
    for number, text in enumerate((*fired[:MAX_DISTURBANCES], *more)):
        yield (StyledText(f"      {'' if number else 'happened':9} ", "quiet"), StyledText(text))


def artifact_lines(run: RunFinished) -> Iterator[StyledLine]:
    """Where to look at a run, and how to see it again."""
    files = run.artifacts
    seen = [("replay", files.replay), ("picture", files.picture)] if files.picture else [("log", files.mcap)]
    for name, path in seen:
        if path:
            yield (_label(name), StyledText(one_line(path), file=path))
    if run.again:
        yield (_label("again"), StyledText(shell_command_text(run.again), shell=True))


def _scenario_line(run: RunFinished) -> StyledLine:
    first = next((complaint.line for complaint in reported_violations(run) if not complaint.warning), 0)
    return (_label("scenario"), StyledText(source_location(run, first), file=scenario_file(run)))


def _label(name: str) -> StyledText:
    return StyledText(f"      {name:9} ", "quiet")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _role(role: str) -> Role:
    roles: dict[str, Role] = {"good": "good", "bad": "bad", "odd": "odd"}
    return roles[role]


MAX_DETAILED_FAILURES = 20
"""Of so many failures it is told where to look; of the others the cause, as they are on the page, too."""
NONDETERMINISTIC = "nondeterministic"

Name = Callable[[RunKey], str]


def failed_runs(runs: Sequence[RunFinished], name: Name) -> Iterator[StyledLine]:
    """Each run that did not pass: its first cause, where to look, how to repeat it.

    Nothing for a run all alone, which has just said all this, and nothing twice of a run that was made twice.
    """
    known = {run.key for run in runs if not run.outcome.good}
    bad = [run for run in runs if run.key in known and (run.key == run.key.first or run.key.first not in known)]
    if not bad or all(run.key.first == bad[0].key.first for run in runs):
        return
    yield (StyledText("did not pass:", "quiet"),)
    for number, run in enumerate(bad):
        sign, _ = SIGNS[run.outcome]
        role: Role = "odd" if run.outcome is Outcome.ERROR else "bad"
        yield (StyledText("  "), StyledText(sign, role), StyledText(f" {name(run.key)}", "name"))
        yield (StyledText("      "), StyledText(_first_cause(run), role))
        if number < MAX_DETAILED_FAILURES:
            yield from artifact_lines(run)


def slowest_runs(runs: Sequence[RunFinished], most: int, name: Name) -> Iterator[StyledLine]:
    """The runs that took longest, the longest first; `most` 0 = all."""
    ordered = sorted((run for run in runs if run.wall), key=lambda run: (-run.wall, run.key))
    yield (StyledText("slowest:", "quiet"),)
    for run in ordered[: most or None]:
        took = f"{run.wall:8.2f} s"
        simulated = f"   {run.result.simulated:.1f} s simulated"
        yield (StyledText(took), StyledText(f"  {name(run.key)}", "name"), StyledText(simulated, "quiet"))


def log_comparison(runs: Sequence[RunFinished]) -> Iterator[StyledLine]:
    """What comparing second runs with first ones has said; nothing where there were none."""
    firsts = {run.key: run for run in runs if not run.key.repeats}
    pairs = [(firsts[run.key.first], run) for run in runs if run.key.repeats and run.key.first in firsts]
    compared = [pair for pair in pairs if all(run.artifacts.mcap for run in pair)]
    if not compared:
        return
    differ = sum(any(_differs(run) for run in pair) for pair in compared)
    told = f"{len(compared)} pair{'s' if len(compared) > 1 else ''} of runs, byte for byte"
    if differ:
        yield (StyledText(f"logs differ: in {differ} of {told}", "odd"),)
    else:
        yield (StyledText(f"logs equal: {told}", "good"),)


def interruption_lines(session: SessionFinished, left: Mapping[str, int]) -> Iterator[StyledLine]:
    """Two lines: what there is, and how to go on. The reports list what is missing."""
    yield (StyledText("interrupted: ", "odd"), *outcome_counts(session, left))
    page = (
        [StyledText("page: ", "quiet"), StyledText(one_line(session.page), file=session.page)] if session.page else []
    )
    go_on = StyledText(f"{'   ' if page else ''}go on with --resume {one_line(session.folder)}", "quiet")
    yield (*page, *([go_on] if session.folder else []))


def _first_cause(run: RunFinished) -> str:
    """Why it did not pass, in one line."""
    if run.outcome is Outcome.ERROR:
        return error_summary(run)
    told = [complaint.message for complaint in reported_violations(run) if not complaint.warning]
    more = f" (and {len(told) - 1} more)" if len(told) > 1 else ""
    return f"{told[0] if told else 'failed'}{more}"


def _differs(run: RunFinished) -> bool:
    return run.result.error is not None and run.result.error.kind == NONDETERMINISTIC
