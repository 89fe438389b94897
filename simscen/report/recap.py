"""What the end of a session says once more: what did not pass, what took long, and whether logs were equal."""

from collections.abc import Callable, Iterator, Mapping, Sequence

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished, SessionFinished
from simscen.report.complaints import broken, complaints
from simscen.report.line import Line, Piece, Role
from simscen.report.lines import SIGNS, counted, pointers
from simscen.report.text import one_line

MOST_POINTED_AT = 20
"""Of so many failures it is told where to look; of the others the cause, as they are on the page, too."""
NONDETERMINISTIC = "nondeterministic"

Name = Callable[[RunKey], str]


def again(runs: Sequence[RunFinished], name: Name) -> Iterator[Line]:
    """Each run that did not pass: its first cause, where to look, how to repeat it.

    Nothing for a run all alone, which has just said all this, and nothing twice of a run that was made twice.
    """
    known = {run.key for run in runs if not run.outcome.good}
    bad = [run for run in runs if run.key in known and (run.key == run.key.first or run.key.first not in known)]
    if not bad or all(run.key.first == bad[0].key.first for run in runs):
        return
    yield (Piece("did not pass:", "quiet"),)
    for number, run in enumerate(bad):
        sign, _ = SIGNS[run.outcome]
        role: Role = "odd" if run.outcome is Outcome.ERROR else "bad"
        yield (Piece("  "), Piece(sign, role), Piece(f" {name(run.key)}", "name"))
        yield (Piece("      "), Piece(_cause(run), role))
        if number < MOST_POINTED_AT:
            yield from pointers(run)


def slowest(runs: Sequence[RunFinished], most: int, name: Name) -> Iterator[Line]:
    """The runs that took longest, the longest first; `most` 0 = all."""
    ordered = sorted((run for run in runs if run.wall), key=lambda run: (-run.wall, run.key))
    yield (Piece("slowest:", "quiet"),)
    for run in ordered[: most or None]:
        took = f"{run.wall:8.2f} s"
        simulated = f"   {run.result.simulated:.1f} s simulated"
        yield (Piece(took), Piece(f"  {name(run.key)}", "name"), Piece(simulated, "quiet"))


def equal_logs(runs: Sequence[RunFinished]) -> Iterator[Line]:
    """What comparing second runs with first ones has said; nothing where there were none."""
    firsts = {run.key: run for run in runs if not run.key.repeats}
    pairs = [(firsts[run.key.first], run) for run in runs if run.key.repeats and run.key.first in firsts]
    compared = [pair for pair in pairs if all(run.artifacts.mcap for run in pair)]
    if not compared:
        return
    differ = sum(any(_differs(run) for run in pair) for pair in compared)
    told = f"{len(compared)} pair{'s' if len(compared) > 1 else ''} of runs, byte for byte"
    if differ:
        yield (Piece(f"logs differ: in {differ} of {told}", "odd"),)
    else:
        yield (Piece(f"logs equal: {told}", "good"),)


def interrupted(session: SessionFinished, left: Mapping[str, int]) -> Iterator[Line]:
    """Two lines: what there is, and how to go on. The reports list what is missing."""
    yield (Piece("interrupted: ", "odd"), *counted(session, left))
    page = [Piece("page: ", "quiet"), Piece(one_line(session.page), file=session.page)] if session.page else []
    go_on = Piece(f"{'   ' if page else ''}go on with --resume {one_line(session.folder)}", "quiet")
    yield (*page, *([go_on] if session.folder else []))


def _cause(run: RunFinished) -> str:
    """Why it did not pass, in one line."""
    if run.outcome is Outcome.ERROR:
        return broken(run)
    told = [complaint.message for complaint in complaints(run) if not complaint.warning]
    more = f" (and {len(told) - 1} more)" if len(told) > 1 else ""
    return f"{told[0] if told else 'failed'}{more}"


def _differs(run: RunFinished) -> bool:
    return run.result.error is not None and run.result.error.kind == NONDETERMINISTIC
