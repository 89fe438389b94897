"""Comparison of stacks or sessions as a section of an HTML page, and as Markdown for GitHub.

A flip is a pair of runs with the same scenario and seed in which only one run passed.
"""

from dataclasses import replace

from simscen.core.records.comparison import BaselineComparison, Comparison, Flip, MetricDifference, OutcomeCounts
from simscen.report.comparison import (
    MAX_CHANGES,
    MAX_FLIPS,
    NO_LINKS,
    Links,
    change_direction,
    change_text,
    comparison_headline,
    difference_cells,
    exclusion_notes,
    listed_outcomes,
    outcome_text,
    session_conclusion,
    with_changed_metrics,
)
from simscen.report.display_text import html_text, one_line

EXPLANATION = (
    "Runs are paired by scenario and seed. Passed: number of passed and of finished runs. Differences are means over "
    "pairs with 95 % bootstrap intervals; p is from McNemar's exact test for outcomes and from Wilcoxon's signed-rank "
    "test for metrics, for significant changes with Holm's correction. -/=/+: pairs with a lower, equal, higher value."
)
"""Explanation of the tables, which is shown next to them."""
_HEADINGS = ("", "pairs", "{0}", "{1}", "difference", "95 % interval", "-/=/+", "p")
"""Headings of the table of metrics. {0} is the name of the baseline, {1} the name of the other stack."""


def comparison_html(comparison: Comparison) -> str:
    """Return the comparison as a `<section>` of the HTML report."""
    names = "".join(
        f"<th>{html_text(name)}<div class='quiet'>{html_text(value)}</div></th>"
        for name, value in comparison.stacks.items()
    )
    rows = "".join(
        f"<tr><td>{html_text(scenario)}</td>{''.join(_outcome_cell(row[name]) for name in comparison.stacks)}</tr>"
        for scenario, row in comparison.outcomes.items()
    )
    total = "".join(_outcome_cell(comparison.total(name)) for name in comparison.stacks)
    total_row = f"<tr><td><b>all</b></td>{total}</tr>" if len(comparison.outcomes) > 1 else ""
    sections = (_comparison_section_html(comparison.baseline, each) for each in comparison.baseline_comparisons)
    return (
        f'<section class="in"><h2>{html_text(" and ".join(comparison.stacks))}</h2><p class="quiet">{EXPLANATION}</p>'
        f"<table><tr><th>passed</th>{names}</tr>{rows}{total_row}</table>"
        f"{''.join(sections)}</section>"
    )


def session_comparison_markdown(comparison: Comparison, links: Links, is_worse: bool) -> list[str]:
    """Return the comparison of one session with the baseline as lines of Markdown, for a pull request.

    `is_worse` states whether the session is significantly worse than the baseline.
    """
    (baseline_comparison,) = comparison.baseline_comparisons
    reduced = replace(comparison, baseline_comparisons=(with_changed_metrics(baseline_comparison),))
    return [
        f"### simscen: {session_conclusion(baseline_comparison, is_worse)}",
        *comparison_markdown(reduced, links, changed_only=True),
    ]


def comparison_markdown(comparison: Comparison, links: Links = NO_LINKS, changed_only: bool = False) -> list[str]:
    """Return the comparison as lines of Markdown.

    `changed_only` omits scenarios whose outcomes are equal for all stacks or sessions.
    """
    cell = markdown_cell
    names = [cell(name) for name in comparison.stacks]
    lines = ["", f"| passed | {' | '.join(names)} |", f"|---|{'---:|' * len(names)}"]
    rows = [
        *listed_outcomes(comparison, changed_only).items(),
        ("all", {name: comparison.total(name) for name in comparison.stacks}),
    ]
    lines += [f"| {cell(name)} | {' | '.join(outcome_text(row[stack]) for stack in row)} |" for name, row in rows]
    for baseline_comparison in comparison.baseline_comparisons:
        lines += ["", f"**{cell(comparison_headline(comparison.baseline, baseline_comparison))}**", ""]
        lines += [
            f"- {cell(flip.scenario)}, seed {flip.seed}: passed with {cell(flip.passed)}, failed with "
            f"{cell(flip.failed)}: {cell(flip.why)}{_link_markdown(flip, links)}"
            for flip in baseline_comparison.flips[:MAX_FLIPS]
        ]
        more = len(baseline_comparison.flips) - MAX_FLIPS
        lines += [f"- and {more} more, in the JSON results"] if more > 0 else []
        if baseline_comparison.differences:
            heads = [cell(head.format(comparison.baseline, baseline_comparison.stack)) for head in _HEADINGS]
            lines += ["", f"| {' | '.join(heads)} |", f"|---|{'---:|' * (len(heads) - 1)}"]
        lines += [f"| {' | '.join(_metric_cells(difference))} |" for difference in baseline_comparison.differences]
        lines += ["", "Significant changes:", ""] if baseline_comparison.changes else []
        lines += [
            f"- {change_direction(change)}: {cell(change_text(change))}"
            for change in baseline_comparison.changes[:MAX_CHANGES]
        ]
        more = len(baseline_comparison.changes) - MAX_CHANGES
        lines += [f"- and {more} more significant changes, in the JSON results"] if more > 0 else []
        lines += [f"\n{cell(note)}" for note in exclusion_notes(baseline_comparison)]
    return [*lines, "", EXPLANATION]


def _link_markdown(flip: Flip, links: Links) -> str:
    """Return the link to the failed run of a flip, in parentheses; "" if there is none."""
    link = links.get((flip.failed, flip.scenario, flip.seed))
    return f" (`{link}`)" if link else ""


_MARKDOWN_ESCAPES = {ord(sign): f"&#{ord(sign)};" for sign in "\\`*_[]|~#@&<>"}


def markdown_cell(text: str) -> str:
    """Escape text for a cell of a Markdown table."""
    return one_line(text).translate(_MARKDOWN_ESCAPES)


def _outcome_cell(outcomes: OutcomeCounts) -> str:
    css_class = "odd" if outcomes.errors else "bad" if outcomes.failed else "good"
    return f'<td class="count {css_class}">{outcome_text(outcomes)}</td>'


def _comparison_section_html(baseline: str, baseline_comparison: BaselineComparison) -> str:
    flips = "".join(
        f'<tr class="{"" if flip.passed == baseline_comparison.stack else "bad"}">'
        f"<td>{'better' if flip.passed == baseline_comparison.stack else 'worse'}</td>"
        f"<td>{html_text(flip.scenario)}</td><td>seed {flip.seed}</td>"
        f"<td>passed with {html_text(flip.passed)}, failed with {html_text(flip.failed)}</td>"
        f"<td>{html_text(flip.why)}</td></tr>"
        for flip in baseline_comparison.flips
    )
    _, *headings = (html_text(head.format(baseline, baseline_comparison.stack)) for head in _HEADINGS)
    heads = "<th></th>" + "".join(f'<th class="margin">{head}</th>' for head in headings)
    rows = "".join(_metric_row_html(difference) for difference in baseline_comparison.differences)
    changes = "".join(
        f'<tr class="{"bad" if change.is_worse else ""}"><td>{change_direction(change)}</td>'
        f"<td>{html_text(change_text(change))}</td></tr>"
        for change in baseline_comparison.changes
    )
    notes = "".join(f'<p class="quiet">{html_text(note)}</p>' for note in exclusion_notes(baseline_comparison))
    return (
        f"<h3>{html_text(comparison_headline(baseline, baseline_comparison))}</h3>"
        + (f"<table>{flips}</table>" if flips else "")
        + (f"<table><tr>{heads}</tr>{rows}</table>" if rows else "")
        + (f"<table><tr><th colspan='2'>significant changes</th></tr>{changes}</table>" if changes else "")
        + notes
    )


def _metric_row_html(metric: MetricDifference) -> str:
    name, *cells = _metric_cells(metric)
    is_significant = metric.interval is not None and not metric.interval[0] <= 0.0 <= metric.interval[1]
    listed = "".join(f'<td class="margin">{cell}</td>' for cell in cells)
    return f"<tr{' class=clear' if is_significant else ''}><td>{name}</td>{listed}</tr>"


def _metric_cells(metric: MetricDifference) -> tuple[str, ...]:
    """Return a row of the table of metrics, with one cell for each of `_HEADINGS`."""
    name, *cells = difference_cells(metric)
    return name, str(metric.pairs), *cells, f"{metric.p:.2g}"
