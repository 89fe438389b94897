"""A session as lines of text: what the console prints, piece by piece with the role of each piece."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from simscen.core.records.run_result import REPEAT_SUFFIX, Outcome, RunKey
from simscen.core.records.session_events import RunFinished, SessionFinished, SessionStarted
from simscen.judge.finding_text import disturbance_line, tightest_margin
from simscen.report.complaints import broken, complaints, excused, failure, label, place, scenario_file
from simscen.report.line import Line, Piece, Role
from simscen.report.text import command, one_line

TAIL = 12
BESIDE_NAME = 33
"""Columns that sign and times take, so that names are padded to what is left of a terminal's."""
NARROWEST = 16
MOST_HAPPENINGS = 8
SIGNS = {
    Outcome.PASSED: ("✓", "good"),
    Outcome.FAILED: ("✗", "bad"),
    Outcome.ERROR: ("!", "odd"),
    Outcome.FAILED_AS_EXPECTED: ("~", "odd"),
    Outcome.SKIPPED: ("-", "odd"),
}


@dataclass(frozen=True)
class Naming:
    """How runs are called in the lines of a session: short, unique, and in a column of `width`.

    `columns` are those of the terminal; None where there is none.
    """

    every_seed: bool = False
    prefix: str = ""
    width: int = 0
    columns: int | None = None

    @classmethod
    def of(cls, session: SessionStarted, columns: int | None = None) -> "Naming":
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
        room = width if columns is None else max(NARROWEST, columns - BESIDE_NAME)
        return cls(every_seed, prefix, min(width, room), columns)

    def name(self, key: RunKey) -> str:
        """The run's name, padded."""
        return f"{label(key, self.every_seed, self.prefix):{self.width}}"


def _common_folder(ids: Sequence[str]) -> str:
    """The folder that all ids begin with, with its slash: "scenarios/"; "" for a single one or none."""
    if len(ids) < 2:
        return ""
    shortest, longest = min(ids), max(ids)
    same = next((k for k, (a, b) in enumerate(zip(shortest, longest, strict=False)) if a != b), len(shortest))
    return shortest[: shortest.rfind("/", 0, same) + 1]


def opening(started: SessionStarted) -> Line:
    """simscen 0.1.0 · 14 scenarios · 2 workers."""
    runs = "" if started.total == started.scenarios else f" · {_count(started.total, 'run')}"
    workers = _count(started.workers, "worker")
    head = f"simscen {started.version} · {_count(started.scenarios, 'scenario')}{_with(started.stacks)}"
    return (Piece(f"{head}{runs} · {workers}", "quiet"),)


def _with(stacks: Sequence[str]) -> str:
    """The one stack that takes the place of the scenarios' own, or how many."""
    disturbance_line = f"stack {one_line(stacks[0])}" if len(stacks) == 1 else f"{len(stacks)} stacks"
    return f" · {disturbance_line}" if stacks else ""


def finished(run: RunFinished, naming: Naming) -> Iterator[Line]:
    """One line for a run that passed; for the others also what was violated, where, and how to see it again."""
    sign, role = SIGNS[run.outcome]
    yield (
        Piece("  "),
        Piece(sign, _role(role)),
        Piece(f" {naming.name(run.key)} ", "name"),
        *_summary(run),
    )
    yield from complained(run)


def complained(run: RunFinished) -> Iterator[Line]:
    """What was violated, where, and how to see it again; nothing but warnings for a run that passed.

    Of one that failed as expected only the reason is of interest, which stands beside its name.
    """
    if run.outcome in (Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED):
        return
    if run.outcome is Outcome.ERROR:
        yield from _broken(run)
    for complaint in complaints(run):
        role = "odd" if complaint.warning or complaint.verdict.status.value != "fail" else "bad"
        word = "warning: " if complaint.warning else ""
        yield (Piece("      "), Piece(f"{word}{complaint.message}", _role(role)))
        yield from (((Piece(f"        {text}", "quiet")),) for text in complaint.detail)
    if run.outcome is not Outcome.PASSED:
        yield from _happened(run)
        yield _scenario(run)
        yield from pointers(run)


def closing(session: SessionFinished, left: Mapping[str, int]) -> Iterator[Line]:
    """13 passed, 1 failed · 402 s simulated in 4.1 s · simscen-out/latest/junit.xml; then the page to open.

    `left` are runs that were not done, by what to say of them.
    """
    yield (*counted(session, left), *_facts(session))
    if session.page:
        yield (Piece("page: ", "quiet"), Piece(one_line(session.page), file=session.page))


def counted(session: SessionFinished, left: Mapping[str, int]) -> Iterator[Piece]:
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
            yield Piece(", ")
        yield Piece(f"{number} {'error' if word == 'errors' and number == 1 else word}", _role(role))


def _facts(session: SessionFinished) -> Iterator[Piece]:
    speed = f" ({session.simulated / session.wall:.0f}x)" if session.wall > 0 else ""
    yield Piece(f" · {session.simulated:.0f} s simulated in {session.wall:.1f} s{speed}", "quiet")
    if session.junit:
        yield Piece(" · ", "quiet")
        yield Piece(one_line(session.junit), "quiet", file=session.junit)


def _summary(run: RunFinished) -> tuple[Piece, ...]:
    if run.outcome is Outcome.SKIPPED:
        return (Piece(excused(run), "quiet"),)
    if run.outcome is Outcome.ERROR and not run.result.simulated:
        return (Piece(f"{failure(run)[0]} after {run.wall:.2f} s", "quiet"),)
    times = f"{run.result.simulated:6.1f} s simulated in {run.wall:.2f} s{', kept' if run.resumed else ''}"
    if run.outcome is Outcome.FAILED_AS_EXPECTED:
        return (Piece(f"{times}   {excused(run)}", "quiet"),)
    nearest = tightest_margin(run.result.verdicts) if run.outcome is Outcome.PASSED else ""
    return (Piece(times, "quiet"), *((Piece(f"   tightest: {one_line(nearest)}", "quiet"),) if nearest else ()))


def _broken(run: RunFinished) -> Iterator[Line]:
    yield (Piece("      "), Piece(broken(run), "odd"))
    yield from ((Piece(f"        | {line}", "quiet"),) for line in failure(run)[2].splitlines()[-TAIL:])


def _happened(run: RunFinished) -> Iterator[Line]:
    """What fired and when; what did not is among the complaints, or may stay away."""
    fired = [one_line(disturbance_line(one, run.result.tick_rate)) for one in run.result.disturbances if one.happened]
    more = [f"and {len(fired) - MOST_HAPPENINGS} more"] if len(fired) > MOST_HAPPENINGS else []
    for number, text in enumerate((*fired[:MOST_HAPPENINGS], *more)):
        yield (Piece(f"      {'' if number else 'happened':9} ", "quiet"), Piece(text))


def pointers(run: RunFinished) -> Iterator[Line]:
    """Where to look at a run, and how to see it again."""
    files = run.artifacts
    seen = [("replay", files.replay), ("picture", files.picture)] if files.picture else [("log", files.mcap)]
    for name, path in seen:
        if path:
            yield (_label(name), Piece(one_line(path), file=path))
    if run.again:
        yield (_label("again"), Piece(command(run.again), shell=True))


def _scenario(run: RunFinished) -> Line:
    first = next((complaint.line for complaint in complaints(run) if not complaint.warning), 0)
    return (_label("scenario"), Piece(place(run, first), file=scenario_file(run)))


def _label(name: str) -> Piece:
    return Piece(f"      {name:9} ", "quiet")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _role(role: str) -> Role:
    roles: dict[str, Role] = {"good": "good", "bad": "bad", "odd": "odd"}
    return roles[role]
