"""Stacks side by side, as lines for the console."""

from collections.abc import Iterator, Sequence

from simscen.core.records.session_events import BaselineComparison, Comparison, MetricDifference, OutcomeCounts
from simscen.report.line import Line, Piece
from simscen.report.text import one_line

MOST_FLIPS = 10
NARROWEST = 24
"""Columns that a scenario's name has at least, however narrow the terminal."""
LONGEST_NAME = 16


def compared(comparison: Comparison, prefix: str = "", columns: int | None = None) -> Iterator[Line]:
    """Outcomes of each scenario with each stack, then each stack against the first.

    `prefix` is what all ids begin with. Names of scenarios are cut to fit into `columns`; None = as long as they are.
    """
    yield ()
    yield from _outcomes(comparison, prefix, columns)
    for against in comparison.against:
        yield ()
        yield from _against(comparison.baseline, against, prefix)
    yield ()


def counted(outcomes: OutcomeCounts) -> str:
    """3/5: passed of those that came to an end; then, with an exclamation mark, how many did not."""
    errors = f" {outcomes.errors}!" if outcomes.errors else ""
    return f"{outcomes.passed}/{outcomes.decided}{errors}"


def left_out(against: BaselineComparison) -> str:
    """What is not compared, and why; "" for nothing."""
    told = []
    if against.broken:
        told.append(f"{_pairs(against.broken)} with an error")
    if against.alone:
        told.append(f"{against.alone} {'run' if against.alone == 1 else 'runs'} without a partner")
    return "left out: " + ", ".join(told) if told else ""


def parted(against: BaselineComparison) -> str:
    """Of how many pairs only one arrived; "" for none."""
    if not against.parted:
        return ""
    return f"of {_pairs(against.parted)} only one run arrived, so how these drove is not compared"


def headline(baseline: str, against: BaselineComparison) -> str:
    """Dwb against ref: 10 pairs, passed 8 and 9 …"""
    won = sum(flip.passed == against.stack for flip in against.flips)
    lost = len(against.flips) - won
    told = f"{against.stack} against {baseline}: {_pairs(against.pairs)} of the same scenario and seed"
    if not against.pairs:
        return f"{against.stack} against {baseline}: nothing to compare"
    if not against.flips:
        return f"{told}, none came out otherwise"
    return f"{told}, {won} better, {lost} worse (p = {against.p:.2g})"


def numbers(one: MetricDifference) -> tuple[str, str, str, str]:
    """The two means, their difference, and its interval; what is below 1 m or 1 s with a digit more."""
    digits = 3 if one.unit and max(abs(one.baseline), abs(one.value)) < 1 else 2
    interval = "" if one.interval is None else " … ".join(f"{bound:+.{digits}f}" for bound in one.interval)
    return f"{one.baseline:.{digits}f}", f"{one.value:.{digits}f}", f"{one.difference:+.{digits}f}", interval


def _outcomes(comparison: Comparison, prefix: str, columns: int | None) -> Iterator[Line]:
    rows = [
        (one_line(scenario.removeprefix(prefix)), [counted(row[name]) for name in comparison.stacks])
        for scenario, row in comparison.outcomes.items()
    ]
    if len(rows) > 1:
        rows.append(("all", [counted(comparison.total(name)) for name in comparison.stacks]))
    heads = [shortened(name) for name in comparison.stacks]
    widths = [max(len(head), *(len(cells[number]) for _, cells in rows)) + 3 for number, head in enumerate(heads)]
    room = None if columns is None else max(NARROWEST, columns - 2 - sum(widths))
    names = [shortened(name, room) if room else name for name, _ in rows]
    longest = max(len(name) for name in ("passed", *names))

    def row(name: str, cells: Sequence[str]) -> str:
        return f"  {name:{longest}}" + "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))

    yield (Piece(row("passed", heads), "quiet"),)
    for name, (_, cells) in zip(names, rows, strict=True):
        yield (Piece(row(name, cells)),)
    if any(row[name].errors for row in comparison.outcomes.values() for name in row):
        yield (Piece("  ! = could not be completed, and counts neither way", "quiet"),)


def _against(baseline: str, against: BaselineComparison, prefix: str) -> Iterator[Line]:
    yield (Piece(f"  {headline(baseline, against)}", "name"),)
    for flip in against.flips[:MOST_FLIPS]:
        better = flip.passed == against.stack
        yield (
            Piece("    "),
            Piece("better" if better else "worse ", "good" if better else "bad"),
            Piece(f" {one_line(flip.scenario.removeprefix(prefix))}, seed {flip.seed}: "),
            Piece(one_line(f"passed with {flip.passed}, failed with {flip.failed}: {flip.why}"), "quiet"),
        )
    if len(against.flips) > MOST_FLIPS:
        yield (Piece(f"    and {len(against.flips) - MOST_FLIPS} more, in results.json", "quiet"),)
    yield from _differences(baseline, against)
    for note in (parted(against), left_out(against)):
        if note:
            yield (Piece(f"    {note}", "quiet"),)


def _differences(baseline: str, against: BaselineComparison) -> Iterator[Line]:
    if not against.differences:
        return
    stacks = shortened(baseline), shortened(against.stack)
    head = ("mean over pairs", *stacks, "difference", "95 % interval", "- / = / +")
    rows = [
        (
            f"{one.metric}, {one.unit}".removesuffix(", "),
            *numbers(one),
            f"{one.lower} / {one.equal} / {one.higher}",
        )
        for one in against.differences
    ]
    columns = list(zip(head, *rows, strict=True))
    widths = [max(map(len, column)) for column in columns]
    for number, row in enumerate((head, *rows)):
        first, *cells = (
            f"{cell:{'>' if place else ''}{width}}" for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        yield (Piece(f"    {'  '.join((first, *cells))}".rstrip(), "plain" if number else "quiet"),)


def shortened(text: str, most: int = LONGEST_NAME) -> str:
    """Text of at most so many columns: beginnings and ends are what names differ in."""
    return text if len(text) <= most else f"{text[: (most - 1) // 2]}…{text[-(most // 2) :]}"


def _pairs(number: int) -> str:
    return f"{number} pair" if number == 1 else f"{number} pairs"
