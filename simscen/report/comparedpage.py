"""Stacks side by side, for the page and for the summary on GitHub."""

from collections.abc import Callable
from html import escape

from simscen.core.records.session_events import BaselineComparison, Comparison, MetricDifference, OutcomeCounts
from simscen.report.compared import MOST_FLIPS, counted, headline, left_out, numbers, parted
from simscen.report.text import one_line

EXPLAINED = (
    "Runs are paired by scenario and seed. Passed: of those that came to an end. Differences are means over pairs, "
    "with 95 % intervals by bootstrap; p is the sign test. - / = / + are pairs in which it was less, the same, more."
)
_HEAD = ("", "pairs", "{0}", "{1}", "difference", "95 % interval", "- / = / +", "p")


def as_html(comparison: Comparison) -> str:
    """A section of the page: outcomes of each scenario, then each stack against the first."""
    names = "".join(
        f"<th>{_text(name)}<div class='quiet'>{_text(given)}</div></th>" for name, given in comparison.stacks.items()
    )
    rows = "".join(
        f"<tr><td>{_text(scenario)}</td>{''.join(_cell(row[name]) for name in comparison.stacks)}</tr>"
        for scenario, row in comparison.outcomes.items()
    )
    total = "".join(_cell(comparison.total(name)) for name in comparison.stacks)
    whole = f"<tr><td><b>all</b></td>{total}</tr>" if len(comparison.outcomes) > 1 else ""
    return (
        f'<section class="in"><h2>{_text(" and ".join(comparison.stacks))}</h2><p class="quiet">{EXPLAINED}</p>'
        f"<table><tr><th>passed</th>{names}</tr>{rows}{whole}</table>"
        f"{''.join(_against(comparison.baseline, one) for one in comparison.against)}</section>"
    )


def as_markdown(comparison: Comparison, cell: Callable[[str], str]) -> list[str]:
    """The same as lines of Markdown; `cell` makes text harmless that others wrote."""
    names = [cell(name) for name in comparison.stacks]
    lines = ["", f"| passed | {' | '.join(names)} |", f"|---|{'---:|' * len(names)}"]
    rows = [*comparison.outcomes.items(), ("all", {name: comparison.total(name) for name in comparison.stacks})]
    lines += [f"| {cell(name)} | {' | '.join(counted(row[stack]) for stack in row)} |" for name, row in rows]
    for against in comparison.against:
        lines += ["", f"**{cell(headline(comparison.baseline, against))}**", ""]
        lines += [
            f"- {cell(flip.scenario)}, seed {flip.seed}: passed with {cell(flip.passed)}, failed with "
            f"{cell(flip.failed)}: {cell(flip.why)}"
            for flip in against.flips[:MOST_FLIPS]
        ]
        more = len(against.flips) - MOST_FLIPS
        lines += [f"- and {more} more, in results.json"] if more > 0 else []
        heads = [cell(head.format(comparison.baseline, against.stack)) for head in _HEAD]
        lines += ["", f"| {' | '.join(heads)} |", f"|---|{'---:|' * (len(heads) - 1)}"]
        lines += [f"| {' | '.join(_cells(one))} |" for one in against.differences]
        lines += [f"\n{cell(note)}" for note in (parted(against), left_out(against)) if note]
    return [*lines, "", EXPLAINED]


def _cell(outcomes: OutcomeCounts) -> str:
    look = "odd" if outcomes.errors else "bad" if outcomes.failed else "good"
    return f'<td class="count {look}">{counted(outcomes)}</td>'


def _against(baseline: str, against: BaselineComparison) -> str:
    flips = "".join(
        f'<tr class="{"" if flip.passed == against.stack else "bad"}">'
        f"<td>{'better' if flip.passed == against.stack else 'worse'}</td><td>{_text(flip.scenario)}</td>"
        f"<td>seed {flip.seed}</td><td>passed with {_text(flip.passed)}, failed with {_text(flip.failed)}</td>"
        f"<td>{_text(flip.why)}</td></tr>"
        for flip in against.flips
    )
    _, *named = (_text(head.format(baseline, against.stack)) for head in _HEAD)
    heads = "<th></th>" + "".join(f'<th class="margin">{head}</th>' for head in named)
    rows = "".join(_difference(one) for one in against.differences)
    notes = "".join(f'<p class="quiet">{_text(note)}</p>' for note in (parted(against), left_out(against)) if note)
    return (
        f"<h3>{_text(headline(baseline, against))}</h3>"
        + (f"<table>{flips}</table>" if flips else "")
        + (f"<table><tr>{heads}</tr>{rows}</table>" if rows else "")
        + notes
    )


def _difference(one: MetricDifference) -> str:
    name, *cells = _cells(one)
    clear = one.interval is not None and not one.interval[0] <= 0.0 <= one.interval[1]
    listed = "".join(f'<td class="margin">{cell}</td>' for cell in cells)
    return f"<tr{' class=clear' if clear else ''}><td>{name}</td>{listed}</tr>"


def _cells(one: MetricDifference) -> tuple[str, ...]:
    """A row of the table of differences."""
    before, after, difference, interval = numbers(one)
    name = f"{one.metric}, {one.unit}".removesuffix(", ")
    signs = f"{one.lower} / {one.equal} / {one.higher}"
    return name, str(one.pairs), before, after, difference, interval, signs, f"{one.p:.2g}"


def _text(text: str) -> str:
    return escape(one_line(text))
