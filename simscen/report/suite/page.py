"""HTML report of a session, report.html: headline, filters, and entries of the runs in a single file."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import groupby

from simscen.core.records.comparison import Comparison
from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.core.records.study import Study
from simscen.report.comparison_markup import comparison_html
from simscen.report.display_text import csp_hash, html_text, number_with_noun
from simscen.report.picture.palette import css_variables
from simscen.report.session_history import PastSession, outcome_change, past_outcomes
from simscen.report.suite import elements
from simscen.report.suite.elements import OUTCOME_SYMBOLS, outcome_symbols
from simscen.report.suite.history_section import history_html
from simscen.report.suite.run_entry import full_run_name, run_element, scenario_folder
from simscen.report.suite.study_section import study_html

ORDER = (Outcome.ERROR, Outcome.FAILED, Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED, Outcome.PASSED)
"""Outcomes in the order in which the page lists the runs."""
MAX_SYMBOLS = 200
"""Maximum number of runs of a scenario whose outcomes are shown as symbols in the heading of the scenario."""
MAX_LISTED_RUNS = 2000
"""Maximum number of runs that the page lists."""
_LINKED_FILES = ("junit.xml", "results.json", "run.json", "console.txt")
"""Files in the output folder to which the headline links."""


@dataclass(frozen=True)
class RunningSession:
    """Progress of a running session: total number of runs, and keys of the runs in progress."""

    total: int
    current: tuple[RunKey, ...] = ()


@dataclass(frozen=True)
class SessionReport:
    """Contents of the report of a session.

    Attributes:
        runs: Finished runs.
        past: Earlier sessions, newest first.
        comparison: Comparison of several stacks; None for one stack.
        folder: Output folder of the session, for links; "" for a page without links.
        files: Names of other reports in the folder, for links.
        progress: Progress of a running session; None for a session that has ended.
        study: Result of `simscen study`; None for other sessions.
        title: Title of the page.
    """

    runs: Sequence[RunFinished]
    past: Sequence[PastSession] = ()
    comparison: Comparison | None = None
    folder: str = ""
    files: Sequence[str] = ()
    progress: RunningSession | None = None
    study: Study | None = None
    title: str = "simscen"


def to_html(report: SessionReport) -> str:
    """Return the page, with errors and failures first and expanded. The pictures are read from their files."""
    totals = Totals(report.runs)
    listed = listed_runs(report.runs)
    ordered = sorted(listed, key=lambda run: run.key)
    groups = [list(group) for _, group in groupby(ordered, key=lambda run: run.key.scenario)]
    groups.sort(key=lambda group: min(ORDER.index(run.outcome) for run in group))
    pictures = elements.embedded_pictures(
        [run for group in groups for run in sorted(group, key=_severity_order)], report.folder
    )
    groups_html = "\n".join(_group_element(group, report, totals, pictures) for group in groups)
    style, script = css_variables() + _asset("suite.css"), _asset("suite.js")
    counts = _outcome_counts(totals)
    comparison = "" if report.comparison is None else comparison_html(report.comparison)
    if report.study is not None:
        comparison += study_html(report.study, listed, report.folder)
    return (
        f'<!doctype html>\n<html lang="en"{" data-live" if report.progress else ""}>\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        f"style-src '{csp_hash(style)}'; script-src '{csp_hash(script)}'; base-uri 'none'; form-action 'none'\">\n"
        f"{'<noscript><meta http-equiv=refresh content=3></noscript>' if report.progress else ''}"
        f"<title>{html_text(report.title)}: {counts}</title>\n<style>{style}</style>\n</head>\n<body>\n"
        f"<header>{_headline(report, totals, counts, len(listed))}</header>\n<main>\n"
        f"{history_html(listed, report.past, totals.good.total() / max(1, len(report.runs)))}{comparison}\n"
        f"{filter_form(listed, report.past)}\n"
        f'<section id="runs" aria-label="runs">\n{groups_html}\n</section>\n'
        '<p id="nothing" class="quiet" hidden>No run matches. <button type="button" id="all">Show all</button></p>\n'
        f"</main>\n<script>{script}</script>\n</body>\n</html>\n"
    )


class Totals:
    """Sums over all runs of the session, including runs that the page does not list.

    Attributes:
        outcomes: Number of runs by outcome.
        simulated_s: Simulated time in s.
        good: Number of runs with a good outcome, by scenario ID.
        runs: Number of all runs, by scenario ID.
    """

    def __init__(self, runs: Iterable[RunFinished]) -> None:
        self.outcomes: Counter[Outcome] = Counter()
        self.simulated_s = 0.0
        self.good: Counter[str] = Counter()
        self.runs: Counter[str] = Counter()
        for run in runs:
            self.outcomes[run.outcome] += 1
            self.simulated_s += run.result.simulated
            self.good[run.key.scenario] += run.outcome.is_good
            self.runs[run.key.scenario] += 1


def listed_runs(runs: Sequence[RunFinished]) -> Sequence[RunFinished]:
    """Return at most MAX_LISTED_RUNS runs. If there are more, failures and errors have priority and come first."""
    if len(runs) <= MAX_LISTED_RUNS:
        return runs
    bad, good = list[int](), list[int]()
    for index, run in enumerate(runs):
        target = good if run.outcome.is_good else bad
        if len(target) < MAX_LISTED_RUNS:
            target.append(index)
    return [runs[index] for index in (*bad, *good)[:MAX_LISTED_RUNS]]


def _headline(report: SessionReport, totals: Totals, counts: str, listed: int) -> str:
    """Return the head of the page. `counts` are the outcomes in words, `listed` is the number of listed runs."""
    links = " · ".join(f'<a href="{name}">{name}</a>' for name in _LINKED_FILES if name in report.files)
    facts = [
        number_with_noun(len(report.runs), "run"),
        f"{totals.simulated_s:.0f} s simulated",
        *([links] if links else []),
    ]
    if listed < len(report.runs):
        facts.append(f"this page lists {listed} of them, those that did not end as expected first")
    return (
        f"<h1>{counts}</h1>"
        f'{_outcome_bar(totals)}<p class="quiet">{" · ".join(facts)}</p>'
        f"{_progress_bar(report.progress, len(report.runs)) if report.progress else ''}"
    )


def _outcome_bar(totals: Totals) -> str:
    """Return a bar with one colored segment per outcome. The length of a segment is the number of runs."""
    parts, start = "", 0
    for outcome in reversed(ORDER):
        number = totals.outcomes[outcome]
        parts += f'<rect class="{outcome.value}" x="{start}" width="{number}" height="1"/>' if number else ""
        start += number
    view = f'viewBox="0 0 {max(start, 1)} 1" preserveAspectRatio="none"'
    return f'<svg class="bar" {view} aria-hidden="true">{parts}</svg>'


def _progress_bar(progress: RunningSession, done: int) -> str:
    """Return a progress bar and the names of the current runs. `done` is the number of finished runs."""
    names = ", ".join(html_text(full_run_name(key)) for key in progress.current)
    return (
        f'<p id="live" role="status"><progress max="{progress.total}" value="{done}" aria-label="runs done">'
        "</progress> "
        f"{done} of {number_with_noun(progress.total, 'run')} done{f', running: {names}' if names else ''} "
        '<button type="button" id="pause" aria-pressed="false">pause</button></p>'
    )


def _group_element(group: list[RunFinished], report: SessionReport, totals: Totals, pictures: dict[RunKey, str]) -> str:
    """Return the entries of the listed runs of one scenario. `pictures` is the HTML of the pictures by run key."""
    name = group[0].key.scenario
    good, number = totals.good[name], totals.runs[name]
    entries = "\n".join(
        run_element(run, report.folder, pictures.get(run.key, ""), past_outcomes(run, report.past), number > 1)
        for run in sorted(group, key=_severity_order)
    )
    if number == 1:
        return f'<div class="group">{entries}</div>'
    changed = sum(outcome_change(run, report.past) != "" for run in group)
    summary = f"{good} of {number} as expected" + (f", {changed} changed" if changed else "")
    opened = "" if good == number else " open"
    marks = outcome_symbols([run.outcome for run in group], "runs") if number <= MAX_SYMBOLS else ""
    return (
        f'<details class="group many"{opened}><summary><h2 class="name">{html_text(name)}</h2>'
        f'<span class="quiet">{summary}</span>{marks}</summary>\n'
        f"{entries}\n</details>"
    )


def _severity_order(run: RunFinished) -> tuple[int, RunKey]:
    return ORDER.index(run.outcome), run.key


def _outcome_counts(totals: Totals) -> str:
    """Return the number of runs by outcome, for example "✓ 12 passed, ✗ 1 failed"."""
    return ", ".join(
        f"{OUTCOME_SYMBOLS[outcome]} {number} {outcome.value.replace('-', ' ')}"
        for outcome in Outcome
        if (number := totals.outcomes[outcome]) or outcome is Outcome.PASSED
    )


@cache
def _asset(name: str) -> str:
    return files("simscen").joinpath("data").joinpath("suite").joinpath(name).read_text("utf-8")


_ORDERS = {
    "": "failures first",
    "name": "by name",
    "simulated": "longest simulated time first",
    "wall": "longest wall time first",
    "margin": "smallest margin first",
}
"""Labels of the orders of runs, by value of the option in the form."""


def filter_form(runs: Sequence[RunFinished], past: Sequence[PastSession]) -> str:
    """Return a form with a search field, filters for properties that differ between runs, and the order of runs."""
    number = Counter(run.outcome for run in runs)
    statuses = "".join(
        f'<label class="{outcome.value}"><input type="checkbox" name="status" value="{outcome.value}" checked> '
        f"{OUTCOME_SYMBOLS[outcome]} {number[outcome]} {outcome.value.replace('-', ' ')}</label>"
        for outcome in Outcome
        if number[outcome]
    )
    changed = sum(outcome_change(run, past) != "" for run in runs)
    if changed:
        statuses += f'<label><input type="checkbox" name="changed"> only changed ({changed})</label>'
    lists = [
        _filter_select("theme", Counter(scenario_folder(run.key) for run in runs)),
        _filter_select("tag", Counter(tag for run in runs for tag in set(run.tags))),
        _filter_select("stack", Counter(run.key.stack_name for run in runs)),
        _filter_select("variation", Counter(run.key.variation for run in runs)),
    ]
    sorts = "".join(f'<option value="{value}">{label}</option>' for value, label in _ORDERS.items())
    return (
        '<form id="controls" role="search" hidden>'
        '<label class="find">search <input type="search" name="find" autocomplete="off" '
        'placeholder="name, tag, criterion, reason …"></label>'
        f"<fieldset><legend>show</legend>{statuses}</fieldset>{''.join(lists)}"
        f'<label>order <select name="order">{sorts}</select></label>'
        '<span id="shown" role="status" class="quiet"></span>'
        '<span class="keys quiet">keys: <kbd>/</kbd> search, <kbd>j</kbd> <kbd>k</kbd> next and previous run, '
        "<kbd>f</kbd> next failure</span></form>"
    )


def _filter_select(name: str, counts: Counter[str]) -> str:
    """Return a filter for a property; "" if all runs have the same value. `counts` is the number of runs by value."""
    named = sorted(value for value in counts if value)
    if not named or len(counts) < 2:
        return ""
    options = "".join(
        f'<option value="{html_text(value)}">{html_text(value)} ({counts[value]})</option>' for value in named
    )
    return f'<label>{name} <select name="{name}"><option value="">all</option>{options}</select></label>'
