"""Comparison of stacks or sessions as console lines, HTML and Markdown."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from html import escape

from simscen.core.records.session_events import (
    BaselineComparison,
    Comparison,
    Flip,
    MetricDifference,
    OutcomeCounts,
    ScenarioChange,
)
from simscen.report.display_text import one_line
from simscen.report.styled_line import Role, StyledLine, StyledText

MAX_FLIPS = 10
"""Maximum number of runs with different outcomes to list."""
MAX_CHANGES = 10
"""Maximum number of significant changes to list."""
MIN_NAME_COLUMNS = 24
"""Minimum width of the column of scenario names."""
MAX_STACK_NAME = 16


Links = Mapping[tuple[str, str, int], str]
"""Replay, log, or command of a failed run by stack or session, scenario, and seed."""
NO_LINKS: Links = {}


def comparison_lines(comparison: Comparison, prefix: str = "", columns: int | None = None) -> Iterator[StyledLine]:
    """Yield a table of outcomes by scenario and stack, then the comparison of each stack with the first one.

    `prefix` is removed from IDs. Names are shortened to fit into `columns`, if given.
    """
    yield ()
    yield from _outcome_table(comparison, prefix, columns)
    for against in comparison.against:
        yield ()
        yield from _comparison_section(comparison.baseline, against, prefix)
    yield ()


def session_comparison_lines(comparison: Comparison, links: Links, is_worse: bool) -> Iterator[StyledLine]:
    """Yield the comparison of a session with the baseline: changed outcomes first, and the verdict last."""
    (against,) = comparison.against
    yield from _comparison_section(comparison.baseline, _with_changed_metrics(against), "", links)
    yield from _outcome_table(comparison, "", None, changed_only=True)
    yield (StyledText(""),)
    lost = any(flip.failed == against.stack for flip in against.flips)
    yield (StyledText(_session_verdict(against, is_worse), "bad" if is_worse else "warning" if lost else "good"),)


def session_comparison_markdown(comparison: Comparison, links: Links, is_worse: bool) -> list[str]:
    """Return the comparison of a session with the baseline as lines of Markdown, for a pull request."""
    (against,) = comparison.against
    shown = replace(comparison, against=(_with_changed_metrics(against),))
    return [f"### simscen: {_session_verdict(against, is_worse)}", *as_markdown(shown, links, changed_only=True)]


def _with_changed_metrics(against: BaselineComparison) -> BaselineComparison:
    """Return the comparison without metrics that are equal in all pairs."""
    return replace(against, differences=tuple(one for one in against.differences if one.equal < one.pairs))


def _session_verdict(against: BaselineComparison, is_worse: bool) -> str:
    lost = sum(flip.failed == against.stack for flip in against.flips)
    if is_worse:
        return f"{against.stack} is significantly worse"
    runs = "1 run fails that passed" if lost == 1 else f"{lost} runs fail that passed"
    more = f"; {runs} before, which may be chance" if lost else ""
    return f"{against.stack} is not significantly worse in {_pairs(against.pairs)}{more}"


def outcome_text(outcomes: OutcomeCounts) -> str:
    """Return passed and finished runs such as "3/5", followed by the number of errors such as "1!"."""
    errors = f" {outcomes.errors}!" if outcomes.errors else ""
    return f"{outcomes.passed}/{outcomes.decided}{errors}"


def excluded_text(against: BaselineComparison) -> str:
    """Return which runs are not compared, and why, or ""."""
    parts = []
    if against.broken:
        parts.append(f"{_pairs(against.broken)} with an error")
    if against.alone:
        parts.append(f"{against.alone} {'run' if against.alone == 1 else 'runs'} without a partner")
    return "left out: " + ", ".join(parts) if parts else ""


def unfinished_text(against: BaselineComparison) -> str:
    """Return the number of pairs in which only one run reached its goals, or ""."""
    if not against.parted:
        return ""
    return f"in {_pairs(against.parted)} only one run reached its goals, so their metrics are not compared"


def comparison_headline(baseline: str, against: BaselineComparison) -> str:
    """Return the result of the comparison in one line: pairs, better and worse outcomes, p-value."""
    won = sum(flip.passed == against.stack for flip in against.flips)
    lost = len(against.flips) - won
    text = f"{against.stack} against {baseline}: {_pairs(against.pairs)} of the same scenario and seed"
    if not against.pairs:
        return f"{against.stack} against {baseline}: nothing to compare"
    if not against.flips:
        return f"{text}, all with equal outcomes"
    return f"{text}, {won} better, {lost} worse (p = {against.p:.2g})"


def change_text(change: ScenarioChange, prefix: str = "") -> str:
    """Return a significant change of a scenario in one line."""
    if change.what == "passed":
        values = f"pass rate {change.baseline:.0%} → {change.value:.0%}"
    else:
        digits = 3 if change.unit and max(abs(change.baseline), abs(change.value)) < 1 else 2
        unit = f" {change.unit}" if change.unit else ""
        values = f"{change.what} {change.baseline:.{digits}f} → {change.value:.{digits}f}{unit}"
    return f"{change.scenario.removeprefix(prefix)}: {values} (p = {change.p:.2g}, {_pairs(change.pairs)})"


def change_verdict(change: ScenarioChange) -> str:
    """Return "worse", "better", or "other" for a metric that may go either way."""
    return "other" if change.is_worse is None else "worse" if change.is_worse else "better"


def difference_columns(one: MetricDifference) -> tuple[str, str, str, str]:
    """Return the two means, their difference, and its interval, with an extra digit for values below 1."""
    digits = 3 if one.unit and max(abs(one.baseline), abs(one.value)) < 1 else 2
    interval = "" if one.interval is None else " … ".join(f"{bound:+.{digits}f}" for bound in one.interval)
    return f"{one.baseline:.{digits}f}", f"{one.value:.{digits}f}", f"{one.difference:+.{digits}f}", interval


def _listed(comparison: Comparison, changed_only: bool) -> dict[str, Mapping[str, OutcomeCounts]]:
    """Return the outcomes by scenario; with `changed_only`, not of those in which as many runs pass as before."""
    return {name: row for name, row in comparison.outcomes.items() if not changed_only or len(set(row.values())) > 1}


def _outcome_table(
    comparison: Comparison, prefix: str, columns: int | None, changed_only: bool = False
) -> Iterator[StyledLine]:
    rows = [
        (one_line(scenario.removeprefix(prefix)), [outcome_text(row[name]) for name in comparison.stacks])
        for scenario, row in _listed(comparison, changed_only).items()
    ]
    if len(comparison.outcomes) > 1 or not rows:
        rows.append(("all", [outcome_text(comparison.total(name)) for name in comparison.stacks]))
    heads = [shorten(name) for name in comparison.stacks]
    widths = [max([len(head), *(len(cells[number]) for _, cells in rows)]) + 3 for number, head in enumerate(heads)]
    available = None if columns is None else max(MIN_NAME_COLUMNS, columns - 2 - sum(widths))
    names = [shorten(name, available) if available else name for name, _ in rows]
    longest = max(len(name) for name in ("passed", *names))

    def row(name: str, cells: Sequence[str]) -> str:
        return f"  {name:{longest}}" + "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))

    yield (StyledText(row("passed", heads), "quiet"),)
    for name, (_, cells) in zip(names, rows, strict=True):
        yield (StyledText(row(name, cells)),)
    if any(row[name].errors for row in comparison.outcomes.values() for name in row):
        yield (StyledText("  ! = runs with errors, which are not counted", "quiet"),)


def _comparison_section(
    baseline: str, against: BaselineComparison, prefix: str, links: Links = NO_LINKS
) -> Iterator[StyledLine]:
    yield (StyledText(f"  {comparison_headline(baseline, against)}", "name"),)
    for flip in against.flips[:MAX_FLIPS]:
        better = flip.passed == against.stack
        yield (
            StyledText("    "),
            StyledText("better" if better else "worse ", "good" if better else "bad"),
            StyledText(f" {one_line(flip.scenario.removeprefix(prefix))}, seed {flip.seed}: "),
            StyledText(one_line(f"passed with {flip.passed}, failed with {flip.failed}: {flip.why}"), "quiet"),
        )
        if link := links.get((flip.failed, flip.scenario, flip.seed)):
            yield (StyledText(f"           {link}"),)
    if len(against.flips) > MAX_FLIPS:
        yield (StyledText(f"    and {len(against.flips) - MAX_FLIPS} more, in results.json", "quiet"),)
    yield from _differences(baseline, against)
    yield from _changes(against, prefix)
    for note in (unfinished_text(against), excluded_text(against)):
        if note:
            yield (StyledText(f"    {note}", "quiet"),)


def _changes(against: BaselineComparison, prefix: str) -> Iterator[StyledLine]:
    if not against.changes:
        return
    yield (StyledText("    significant changes of single scenarios", "quiet"),)
    roles: dict[str, Role] = {"worse": "bad", "better": "good", "other": "plain"}
    for change in against.changes[:MAX_CHANGES]:
        verdict = change_verdict(change)
        yield (
            StyledText("    "),
            StyledText(f"{verdict:6}", roles[verdict]),
            StyledText(f" {one_line(change_text(change, prefix))}"),
        )
    if len(against.changes) > MAX_CHANGES:
        yield (StyledText(f"    and {len(against.changes) - MAX_CHANGES} more, in JSON", "quiet"),)


def _differences(baseline: str, against: BaselineComparison) -> Iterator[StyledLine]:
    if not against.differences:
        return
    stacks = shorten(baseline), shorten(against.stack)
    head = ("mean over pairs", *stacks, "difference", "95 % interval", "-/=/+")
    rows = [
        (
            f"{one.metric}, {one.unit}".removesuffix(", "),
            *difference_columns(one),
            f"{one.lower}/{one.equal}/{one.higher}",
        )
        for one in against.differences
    ]
    columns = list(zip(head, *rows, strict=True))
    widths = [max(map(len, column)) for column in columns]
    for number, row in enumerate((head, *rows)):
        first, *cells = (
            f"{cell:{'>' if place else ''}{width}}" for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        yield (StyledText(f"    {'  '.join((first, *cells))}".rstrip(), "plain" if number else "quiet"),)


def shorten(text: str, most: int = MAX_STACK_NAME) -> str:
    """Shorten text to `most` characters by removing its middle."""
    return text if len(text) <= most else f"{text[: (most - 1) // 2]}…{text[-(most // 2) :]}"


def _pairs(number: int) -> str:
    return f"{number} pair" if number == 1 else f"{number} pairs"


EXPLANATION = (
    "Runs are paired by scenario and seed. Passed: number of passed and of finished runs. Differences are means over "
    "pairs with 95 % bootstrap intervals; p is from McNemar's exact test for outcomes and from Wilcoxon's signed-rank "
    "test for metrics, for single scenarios with Holm's correction. -/=/+: pairs with a lower, equal, higher value."
)
_HEAD = ("", "pairs", "{0}", "{1}", "difference", "95 % interval", "-/=/+", "p")


def as_html(comparison: Comparison) -> str:
    """Return the comparison as a section of the report."""
    names = "".join(
        f"<th>{_html_text(name)}<div class='quiet'>{_html_text(given)}</div></th>"
        for name, given in comparison.stacks.items()
    )
    rows = "".join(
        f"<tr><td>{_html_text(scenario)}</td>{''.join(_cell(row[name]) for name in comparison.stacks)}</tr>"
        for scenario, row in comparison.outcomes.items()
    )
    total = "".join(_cell(comparison.total(name)) for name in comparison.stacks)
    whole = f"<tr><td><b>all</b></td>{total}</tr>" if len(comparison.outcomes) > 1 else ""
    return (
        f'<section class="in"><h2>{_html_text(" and ".join(comparison.stacks))}</h2><p class="quiet">{EXPLANATION}</p>'
        f"<table><tr><th>passed</th>{names}</tr>{rows}{whole}</table>"
        f"{''.join(_against_html(comparison.baseline, one) for one in comparison.against)}</section>"
    )


def as_markdown(comparison: Comparison, links: Links = NO_LINKS, changed_only: bool = False) -> list[str]:
    """Return the comparison as lines of Markdown; `changed_only` omits scenarios in which as many runs pass."""
    cell = markdown_cell
    names = [cell(name) for name in comparison.stacks]
    lines = ["", f"| passed | {' | '.join(names)} |", f"|---|{'---:|' * len(names)}"]
    rows = [
        *_listed(comparison, changed_only).items(),
        ("all", {name: comparison.total(name) for name in comparison.stacks}),
    ]
    lines += [f"| {cell(name)} | {' | '.join(outcome_text(row[stack]) for stack in row)} |" for name, row in rows]
    for against in comparison.against:
        lines += ["", f"**{cell(comparison_headline(comparison.baseline, against))}**", ""]
        lines += [
            f"- {cell(flip.scenario)}, seed {flip.seed}: passed with {cell(flip.passed)}, failed with "
            f"{cell(flip.failed)}: {cell(flip.why)}{_link_markdown(flip, links)}"
            for flip in against.flips[:MAX_FLIPS]
        ]
        more = len(against.flips) - MAX_FLIPS
        lines += [f"- and {more} more, in results.json"] if more > 0 else []
        heads = [cell(head.format(comparison.baseline, against.stack)) for head in _HEAD]
        lines += ["", f"| {' | '.join(heads)} |", f"|---|{'---:|' * (len(heads) - 1)}"]
        lines += [f"| {' | '.join(_cells(one))} |" for one in against.differences]
        lines += [""] if against.changes else []
        lines += [f"- {change_verdict(one)}: {cell(change_text(one))}" for one in against.changes[:MAX_CHANGES]]
        more = len(against.changes) - MAX_CHANGES
        lines += [f"- and {more} more significant changes, in JSON"] if more > 0 else []
        lines += [f"\n{cell(note)}" for note in (unfinished_text(against), excluded_text(against)) if note]
    return [*lines, "", EXPLANATION]


def _link_markdown(flip: Flip, links: Links) -> str:
    link = links.get((flip.failed, flip.scenario, flip.seed))
    return f" (`{link}`)" if link else ""


_MARKDOWN_ESCAPES = {ord(sign): f"&#{ord(sign)};" for sign in "\\`*_[]|~#@&<>"}


def markdown_cell(text: str) -> str:
    """Escape text for a cell of a Markdown table."""
    return one_line(text).translate(_MARKDOWN_ESCAPES)


def _cell(outcomes: OutcomeCounts) -> str:
    look = "odd" if outcomes.errors else "bad" if outcomes.failed else "good"
    return f'<td class="count {look}">{outcome_text(outcomes)}</td>'


def _against_html(baseline: str, against: BaselineComparison) -> str:
    flips = "".join(
        f'<tr class="{"" if flip.passed == against.stack else "bad"}">'
        f"<td>{'better' if flip.passed == against.stack else 'worse'}</td><td>{_html_text(flip.scenario)}</td>"
        f"<td>seed {flip.seed}</td>"
        f"<td>passed with {_html_text(flip.passed)}, failed with {_html_text(flip.failed)}</td>"
        f"<td>{_html_text(flip.why)}</td></tr>"
        for flip in against.flips
    )
    _, *named = (_html_text(head.format(baseline, against.stack)) for head in _HEAD)
    heads = "<th></th>" + "".join(f'<th class="margin">{head}</th>' for head in named)
    rows = "".join(_difference(one) for one in against.differences)
    changes = "".join(
        f'<tr class="{"bad" if one.is_worse else ""}"><td>{change_verdict(one)}</td>'
        f"<td>{_html_text(change_text(one))}</td></tr>"
        for one in against.changes
    )
    notes = "".join(
        f'<p class="quiet">{_html_text(note)}</p>'
        for note in (unfinished_text(against), excluded_text(against))
        if note
    )
    return (
        f"<h3>{_html_text(comparison_headline(baseline, against))}</h3>"
        + (f"<table>{flips}</table>" if flips else "")
        + (f"<table><tr>{heads}</tr>{rows}</table>" if rows else "")
        + (f"<table>{changes}</table>" if changes else "")
        + notes
    )


def _difference(one: MetricDifference) -> str:
    name, *cells = _cells(one)
    clear = one.interval is not None and not one.interval[0] <= 0.0 <= one.interval[1]
    listed = "".join(f'<td class="margin">{cell}</td>' for cell in cells)
    return f"<tr{' class=clear' if clear else ''}><td>{name}</td>{listed}</tr>"


def _cells(one: MetricDifference) -> tuple[str, ...]:
    """Return a row of the table of differences."""
    before, after, difference, interval = difference_columns(one)
    name = f"{one.metric}, {one.unit}".removesuffix(", ")
    signs = f"{one.lower}/{one.equal}/{one.higher}"
    return name, str(one.pairs), before, after, difference, interval, signs, f"{one.p:.2g}"


def _html_text(text: str) -> str:
    return escape(one_line(text))
