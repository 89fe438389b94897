"""Comparison of stacks or sessions as console lines, and texts that the HTML and Markdown reports use as well."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from simscen.core.records.comparison import (
    BaselineComparison,
    Comparison,
    MetricDifference,
    OutcomeCounts,
    ScenarioChange,
)
from simscen.judge.significance import PASS_RATE
from simscen.report.display_text import Role, StyledLine, StyledText, number_with_noun, one_line

MAX_FLIPS = 10
"""Maximum number of listed flips (pairs of runs with the same scenario and seed in which only one run passed)."""
MAX_CHANGES = 10
"""Maximum number of listed significant changes of a comparison, over all its scenarios."""
MIN_NAME_COLUMNS = 24
"""Minimum width of the column of scenario names, in characters."""
MAX_STACK_NAME_COLUMNS = 16
"""Maximum width of the name of a stack or session in a heading, in characters."""


Links = Mapping[tuple[str, str, int], str]
"""Path of the replay or log of each failed run, or the command that repeats the run, by (stack, scenario ID, seed).

If sessions are compared, the name of the session takes the place of the stack."""
NO_LINKS: Links = {}


def comparison_lines(comparison: Comparison, prefix: str = "", columns: int | None = None) -> Iterator[StyledLine]:
    """Yield a table of outcomes by scenario and stack, then the comparison of each further stack with the first one.

    `prefix` is removed from scenario IDs. Long scenario IDs are shortened so that a line has at most `columns`
    characters; None: no limit.
    """
    yield ()
    yield from _outcome_table(comparison, prefix, columns)
    for baseline_comparison in comparison.baseline_comparisons:
        yield ()
        yield from _comparison_section(comparison.baseline, baseline_comparison, prefix)
    yield ()


def session_comparison_lines(comparison: Comparison, links: Links, is_worse: bool) -> Iterator[StyledLine]:
    """Yield the comparison of one session with the baseline, a table of changed outcomes, and a conclusion.

    `is_worse` states whether the session is significantly worse than the baseline.
    """
    (baseline_comparison,) = comparison.baseline_comparisons
    yield from _comparison_section(comparison.baseline, with_changed_metrics(baseline_comparison), "", links)
    yield from _outcome_table(comparison, "", None, changed_only=True)
    yield (StyledText(""),)
    newly_fails = any(flip.failed == baseline_comparison.stack for flip in baseline_comparison.flips)
    is_doubtful = newly_fails or baseline_comparison.error_pairs or not baseline_comparison.pairs
    yield (
        StyledText(
            session_conclusion(baseline_comparison, is_worse),
            "bad" if is_worse else "warning" if is_doubtful else "good",
        ),
    )


def with_changed_metrics(baseline_comparison: BaselineComparison) -> BaselineComparison:
    """Return the comparison without metrics that are equal in all pairs of runs."""
    return replace(
        baseline_comparison,
        differences=tuple(
            difference for difference in baseline_comparison.differences if difference.equal < difference.pairs
        ),
    )


def session_conclusion(baseline_comparison: BaselineComparison, is_worse: bool) -> str:
    """Return a sentence on whether a session is significantly worse than the baseline; if not, on newly failed runs."""
    if not baseline_comparison.pairs:
        return f"nothing was compared: {', '.join(_exclusions(baseline_comparison)) or 'there are no runs'}"
    newly_failed = sum(flip.failed == baseline_comparison.stack for flip in baseline_comparison.flips)
    if is_worse:
        return f"{baseline_comparison.stack} is significantly worse"
    runs = "1 run fails that passed" if newly_failed == 1 else f"{newly_failed} runs fail that passed"
    more = f"; {runs} before, which may be chance" if newly_failed else ""
    pairs = number_with_noun(baseline_comparison.pairs, "pair")
    return f"{baseline_comparison.stack} is not significantly worse in {pairs}{more}"


def outcome_text(outcomes: OutcomeCounts) -> str:
    """Return the numbers of passed and completed runs, such as "3/5", or "3/5 1!" with one run that had an error."""
    errors = f" {outcomes.errors}!" if outcomes.errors else ""
    return f"{outcomes.passed}/{outcomes.decided}{errors}"


def exclusion_notes(baseline_comparison: BaselineComparison) -> list[str]:
    """Return notes on pairs in which only one run arrived, pairs with an error, and runs without a partner."""
    notes = []
    if baseline_comparison.pairs_with_different_arrivals:
        pairs = number_with_noun(baseline_comparison.pairs_with_different_arrivals, "pair")
        notes.append(f"only collisions are compared in {pairs}: only one run reached the last goal")
    excluded = _exclusions(baseline_comparison)
    return [*notes, f"left out: {', '.join(excluded)}"] if excluded else notes


def _exclusions(baseline_comparison: BaselineComparison) -> list[str]:
    excluded = []
    if baseline_comparison.error_pairs:
        excluded.append(f"{number_with_noun(baseline_comparison.error_pairs, 'pair')} with an error")
    if baseline_comparison.unpaired_runs:
        excluded.append(f"{number_with_noun(baseline_comparison.unpaired_runs, 'run')} without a partner")
    return excluded


def comparison_headline(baseline: str, baseline_comparison: BaselineComparison) -> str:
    """Return the result of the comparison in one line: pairs, better and worse outcomes, p-value."""
    better = sum(flip.passed == baseline_comparison.stack for flip in baseline_comparison.flips)
    worse = len(baseline_comparison.flips) - better
    names = f"{baseline_comparison.stack} against {baseline}"
    if not baseline_comparison.pairs:
        return f"{names}: nothing to compare"
    pairs = f"{number_with_noun(baseline_comparison.pairs, 'pair')} of the same scenario and seed"
    if not baseline_comparison.flips:
        return f"{names}: {pairs}, all with equal outcomes"
    return f"{names}: {pairs}, {better} better, {worse} worse (p = {baseline_comparison.p:.2g})"


def change_text(change: ScenarioChange, prefix: str = "") -> str:
    """Return a significant change of a scenario in one line. `prefix` is removed from the scenario ID."""
    if change.what == PASS_RATE:
        values = f"{PASS_RATE} {change.baseline:.0%} → {change.value:.0%}"
    else:
        digits = 3 if change.unit and max(abs(change.baseline), abs(change.value)) < 1 else 2
        unit = f" {change.unit}" if change.unit else ""
        values = f"{change.what} {change.baseline:.{digits}f} → {change.value:.{digits}f}{unit}"
    pairs = number_with_noun(change.pairs, "pair")
    return f"{change.scenario.removeprefix(prefix)}: {values} (p = {change.p:.2g}, {pairs})"


def change_direction(change: ScenarioChange) -> str:
    """Return "worse" or "better", or "other" if no direction of the metric is better."""
    return "other" if change.is_worse is None else "worse" if change.is_worse else "better"


def difference_cells(metric: MetricDifference) -> tuple[str, str, str, str, str, str]:
    """Return the cells of a row of the table of metrics as text.

    The cells are: name and unit, mean of the baseline, mean of the other stack, difference, 95 % interval of the
    difference ("" if unknown), and the numbers of pairs with a lower, equal, and higher value.
    """
    digits = 3 if metric.unit and max(abs(metric.baseline), abs(metric.value)) < 1 else 2
    return (
        f"{metric.metric}, {metric.unit}".removesuffix(", "),
        f"{metric.baseline:.{digits}f}",
        f"{metric.value:.{digits}f}",
        f"{metric.difference:+.{digits}f}",
        "" if metric.interval is None else " … ".join(f"{bound:+.{digits}f}" for bound in metric.interval),
        f"{metric.lower}/{metric.equal}/{metric.higher}",
    )


def listed_outcomes(comparison: Comparison, changed_only: bool) -> dict[str, Mapping[str, OutcomeCounts]]:
    """Return the outcomes by scenario ID and stack; with `changed_only`, only scenarios in which stacks differ."""
    return {name: row for name, row in comparison.outcomes.items() if not changed_only or len(set(row.values())) > 1}


def _outcome_table(
    comparison: Comparison, prefix: str, columns: int | None, changed_only: bool = False
) -> Iterator[StyledLine]:
    """Yield a heading, a row for each listed scenario, and the totals if there are several scenarios."""
    rows = [
        (one_line(scenario.removeprefix(prefix)), [outcome_text(row[name]) for name in comparison.stacks])
        for scenario, row in listed_outcomes(comparison, changed_only).items()
    ]
    if len(comparison.outcomes) > 1 or not rows:
        rows.append(("all", [outcome_text(comparison.total(name)) for name in comparison.stacks]))
    headings = [shorten(name) for name in comparison.stacks]
    widths = [
        max([len(heading), *(len(cells[column]) for _, cells in rows)]) + 3 for column, heading in enumerate(headings)
    ]
    available = None if columns is None else max(MIN_NAME_COLUMNS, columns - 2 - sum(widths))
    names = [shorten(name, available) if available else name for name, _ in rows]
    longest = max(len(name) for name in ("passed", *names))

    def format_row(name: str, cells: Sequence[str]) -> str:
        return f"  {name:{longest}}" + "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))

    yield (StyledText(format_row("passed", headings), "quiet"),)
    for name, (_, cells) in zip(names, rows, strict=True):
        yield (StyledText(format_row(name, cells)),)
    if any(row[name].errors for row in comparison.outcomes.values() for name in row):
        yield (StyledText("  ! = runs with errors, which are not counted", "quiet"),)


def _comparison_section(
    baseline: str, baseline_comparison: BaselineComparison, prefix: str, links: Links = NO_LINKS
) -> Iterator[StyledLine]:
    yield (StyledText(f"  {comparison_headline(baseline, baseline_comparison)}", "name"),)
    for flip in baseline_comparison.flips[:MAX_FLIPS]:
        is_better = flip.passed == baseline_comparison.stack
        yield (
            StyledText("    "),
            StyledText("better" if is_better else "worse ", "good" if is_better else "bad"),
            StyledText(f" {one_line(flip.scenario.removeprefix(prefix))}, seed {flip.seed}: "),
            StyledText(one_line(f"passed with {flip.passed}, failed with {flip.failed}: {flip.why}"), "quiet"),
        )
        if link := links.get((flip.failed, flip.scenario, flip.seed)):
            yield (StyledText(f"           {link}"),)
    if len(baseline_comparison.flips) > MAX_FLIPS:
        yield (StyledText(f"    and {len(baseline_comparison.flips) - MAX_FLIPS} more, in the JSON results", "quiet"),)
    yield from _metric_table(baseline, baseline_comparison)
    yield from _change_lines(baseline_comparison, prefix)
    for note in exclusion_notes(baseline_comparison):
        yield (StyledText(f"    {note}", "quiet"),)


def _change_lines(baseline_comparison: BaselineComparison, prefix: str) -> Iterator[StyledLine]:
    if not baseline_comparison.changes:
        return
    yield (StyledText("    significant changes", "quiet"),)
    roles: dict[str, Role] = {"worse": "bad", "better": "good", "other": "plain"}
    for change in baseline_comparison.changes[:MAX_CHANGES]:
        direction = change_direction(change)
        yield (
            StyledText("    "),
            StyledText(f"{direction:6}", roles[direction]),
            StyledText(f" {one_line(change_text(change, prefix))}"),
        )
    if len(baseline_comparison.changes) > MAX_CHANGES:
        yield (
            StyledText(f"    and {len(baseline_comparison.changes) - MAX_CHANGES} more, in the JSON results", "quiet"),
        )


def _metric_table(baseline: str, baseline_comparison: BaselineComparison) -> Iterator[StyledLine]:
    if not baseline_comparison.differences:
        return
    stacks = shorten(baseline), shorten(baseline_comparison.stack)
    headings = ("mean over pairs", *stacks, "difference", "95 % interval", "-/=/+")
    rows = [difference_cells(difference) for difference in baseline_comparison.differences]
    columns = list(zip(headings, *rows, strict=True))
    widths = [max(map(len, column)) for column in columns]
    for number, row in enumerate((headings, *rows)):
        cells = (
            f"{cell:{'>' if column else ''}{width}}"
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        yield (StyledText(f"    {'  '.join(cells)}".rstrip(), "plain" if number else "quiet"),)


def shorten(text: str, max_length: int = MAX_STACK_NAME_COLUMNS) -> str:
    """Shorten text to `max_length` characters by replacing its middle with "…"."""
    return text if len(text) <= max_length else f"{text[: (max_length - 1) // 2]}…{text[-(max_length // 2) :]}"
