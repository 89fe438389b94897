"""A session as lines of text: what the console prints, piece by piece with the role of each piece."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from simscen.core.result import Outcome, RunKey
from simscen.core.sessionevents import (
    RunFinished,
    RunProgress,
    RunStarted,
    SessionEvent,
    SessionFinished,
    SessionStarted,
)
from simscen.judge.wording import tightest, told
from simscen.report.compared import compared
from simscen.report.complaints import broken, complaints, excused, failure, label, place
from simscen.report.line import Line, Piece, Role
from simscen.report.text import command, one_line

TAIL = 12
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
        extra = [*(["seed 1234"] if every_seed else []), *([max(stacks, key=len)] if stacks else [])]
        return cls(every_seed, prefix, longest + (len(f" ({', '.join(extra)})") if extra else 0), columns)

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


def lines_of(event: SessionEvent, naming: Naming) -> list[Line]:
    """What an event is worth."""
    match event:
        case SessionStarted():
            return [opening(event)]
        case RunFinished():
            return list(finished(event, naming))
        case SessionFinished():
            told = event.comparison and compared(event.comparison, naming.prefix, naming.columns)
            return [*(told or ()), *closing(event)]
        case RunStarted() | RunProgress():
            return []


def opening(started: SessionStarted) -> Line:
    """simscen 0.1.0 · 14 scenarios · 2 workers."""
    runs = "" if started.total == started.scenarios else f" · {_count(started.total, 'run')}"
    workers = _count(started.workers, "worker")
    head = f"simscen {started.version} · {_count(started.scenarios, 'scenario')}{_with(started.stacks)}"
    return (Piece(f"{head}{runs} · {workers}", "quiet"),)


def _with(stacks: Sequence[str]) -> str:
    """The one stack that takes the place of the scenarios' own, or how many."""
    told = f"stack {one_line(stacks[0])}" if len(stacks) == 1 else f"{len(stacks)} stacks"
    return f" · {told}" if stacks else ""


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
        yield from _pointers(run)


def closing(session: SessionFinished) -> Iterator[Line]:
    """13 passed, 1 failed · 402 s simulated in 4.1 s (98x) · simscen-out/latest/junit.xml."""
    counts = [
        (session.passed, "passed", "good"),
        (session.failed, "failed", "bad"),
        (session.errors, "errors", "odd"),
        (session.expected, "failed as expected", "odd"),
        (session.skipped, "skipped", "odd"),
    ]
    shown = [(number, word, role) for number, word, role in counts if number or word == "passed"]
    pieces: list[Piece] = []
    for number, word, role in shown:
        pieces += [Piece(", ")] if pieces else []
        pieces.append(Piece(f"{number} {'error' if word == 'errors' and number == 1 else word}", _role(role)))
    speed = f" ({session.simulated / session.wall:.0f}x)" if session.wall > 0 else ""
    facts = f" · {session.simulated:.0f} s simulated in {session.wall:.1f} s{speed}"
    files = f" · {one_line(session.junit)}" if session.junit else ""
    yield (*pieces, Piece(facts + files, "quiet"))
    if session.interrupted:
        yield (Piece("interrupted: the runs that are missing are listed as such in the reports", "odd"),)


def text_of(line: Line) -> str:
    """The line without its roles."""
    return "".join(piece.text for piece in line).rstrip()


def _summary(run: RunFinished) -> tuple[Piece, ...]:
    if run.outcome is Outcome.SKIPPED:
        return (Piece(excused(run), "quiet"),)
    if run.outcome is Outcome.ERROR and not run.result.simulated:
        return (Piece(f"{failure(run)[0]} after {run.wall:.2f} s", "quiet"),)
    times = f"{run.result.simulated:6.1f} s simulated in {run.wall:.2f} s"
    if run.outcome is Outcome.FAILED_AS_EXPECTED:
        return (Piece(f"{times}   {excused(run)}", "quiet"),)
    nearest = tightest(run.result.verdicts) if run.outcome is Outcome.PASSED else ""
    return (Piece(times, "quiet"), *((Piece(f"   tightest: {one_line(nearest)}", "quiet"),) if nearest else ()))


def _broken(run: RunFinished) -> Iterator[Line]:
    yield (Piece("      "), Piece(broken(run), "odd"))
    yield from ((Piece(f"        | {line}", "quiet"),) for line in failure(run)[2].splitlines()[-TAIL:])


def _happened(run: RunFinished) -> Iterator[Line]:
    """What fired and when; what did not is among the complaints, or may stay away."""
    fired = [one_line(told(one, run.result.tick_rate)) for one in run.result.disturbances if one.happened]
    more = [f"and {len(fired) - MOST_HAPPENINGS} more"] if len(fired) > MOST_HAPPENINGS else []
    for number, text in enumerate((*fired[:MOST_HAPPENINGS], *more)):
        yield (Piece(f"      {'' if number else 'happened':9} ", "quiet"), Piece(text))


def _pointers(run: RunFinished) -> Iterator[Line]:
    first = next((complaint.line for complaint in complaints(run) if not complaint.warning), 0)
    files = [("scenario", place(run, first)), ("picture", run.artifacts.picture), ("log", run.artifacts.mcap)]
    shown = [(name, one_line(text)) for name, text in (*files[:2], *(() if run.artifacts.picture else files[2:]))]
    for name, text in (*shown, ("again", command(run.again))):
        if text:
            yield (Piece(f"      {name:9} ", "quiet"), Piece(text))


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _role(role: str) -> Role:
    roles: dict[str, Role] = {"good": "good", "bad": "bad", "odd": "odd"}
    return roles[role]
