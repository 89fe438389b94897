"""HTML report: a single file that loads nothing from the network, with filters, history and runs."""

import base64
import hashlib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import groupby
from urllib.parse import quote

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import Comparison, RunFinished
from simscen.core.records.study import Study
from simscen.report.comparison_markup import comparison_html
from simscen.report.display_text import html_text, number_with_noun
from simscen.report.picture.palette import css_variables
from simscen.report.session_history import PastSession, outcome_change, past_outcomes
from simscen.report.suite import elements
from simscen.report.suite.elements import OUTCOME_SYMBOLS, anchor, outcome_symbols, sparkline
from simscen.report.suite.run_entry import full_run_name, run_element, theme
from simscen.report.suite.study_section import study_html

ORDER = (Outcome.ERROR, Outcome.FAILED, Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED, Outcome.PASSED)
MAX_MARKS = 200
"""If a scenario has at most this many runs, its heading shows a mark for each of them."""
MAX_LISTED = 2000
"""Maximum number of runs on the page."""
_FILES = ("report.html", "junit.xml", "results.json", "run.json", "console.txt")


@dataclass(frozen=True)
class RunningSession:
    """Progress of a running session: the number of all runs, and the current runs."""

    total: int
    current: tuple[RunKey, ...] = ()


@dataclass(frozen=True)
class Session:
    """Contents of the report.

    Attributes:
        runs: Finished runs.
        past: Earlier sessions, newest first.
        comparison: Comparison of several stacks.
        folder: Output folder of the session, for links.
        files: Names of the other files in the folder.
        live: Progress of a running session.
        study: Result of `simscen study`.
        title: Title of the page.
    """

    runs: Sequence[RunFinished]
    past: Sequence[PastSession] = ()
    comparison: Comparison | None = None
    folder: str = ""
    files: Sequence[str] = ()
    live: RunningSession | None = None
    study: Study | None = None
    title: str = "simscen"


def to_html(session: Session) -> str:
    """Return the report as HTML, with failures first and expanded. Reads the pictures of the runs."""
    totals = Totals(session.runs)
    listed = listed_runs(session.runs)
    ordered = sorted(listed, key=lambda run: run.key)
    groups = [list(group) for _, group in groupby(ordered, key=lambda run: run.key.scenario)]
    groups.sort(key=lambda group: min(ORDER.index(run.outcome) for run in group))
    pictures = elements.embedded_pictures(
        [run for group in groups for run in sorted(group, key=_severity_order)], session.folder
    )
    groups_html = "\n".join(_group_element(group, session, totals, pictures) for group in groups)
    style, script = css_variables() + _asset("suite.css"), _asset("suite.js")
    counts = _outcome_counts(totals)
    comparison = "" if session.comparison is None else comparison_html(session.comparison)
    if session.study is not None:
        comparison += study_html(session.study, listed, session.folder)
    return (
        f'<!doctype html>\n<html lang="en"{" data-live" if session.live else ""}>\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        f"style-src {_hash(style)}; script-src {_hash(script)}; base-uri 'none'; form-action 'none'\">\n"
        f"{'<noscript><meta http-equiv=refresh content=3></noscript>' if session.live else ''}"
        f"<title>{html_text(session.title)}: {counts}</title>\n<style>{style}</style>\n</head>\n<body>\n"
        f"<header>{_headline(session, totals, counts, len(listed))}</header>\n<main>\n"
        f"{history_section(listed, session.past)}{comparison}\n"
        f"{filter_form(listed, session.past)}\n"
        f'<section id="runs" aria-label="runs">\n{groups_html}\n</section>\n'
        '<p id="nothing" class="quiet" hidden>No run matches. <button type="button" id="all">Show all</button></p>\n'
        f"</main>\n<script>{script}</script>\n</body>\n</html>\n"
    )


class Totals:
    """Sums over all runs: runs by outcome, simulated seconds, and by scenario the good runs and all runs."""

    def __init__(self, runs: Iterable[RunFinished]) -> None:
        self.outcomes: Counter[Outcome] = Counter()
        self.simulated = 0.0
        self.good: Counter[str] = Counter()
        self.runs: Counter[str] = Counter()
        for run in runs:
            self.outcomes[run.outcome] += 1
            self.simulated += run.result.simulated
            self.good[run.key.scenario] += run.outcome.good
            self.runs[run.key.scenario] += 1


def listed_runs(runs: Sequence[RunFinished]) -> Sequence[RunFinished]:
    """Return at most MAX_LISTED of the runs, those that did not end as expected first."""
    if len(runs) <= MAX_LISTED:
        return runs
    bad, good = list[int](), list[int]()
    for index, run in enumerate(runs):
        target = good if run.outcome.good else bad
        if len(target) < MAX_LISTED:
            target.append(index)
    return [runs[index] for index in (*bad, *good)[:MAX_LISTED]]


def _headline(session: Session, totals: Totals, counts: str, listed: int) -> str:
    links = " · ".join(f'<a href="{name}">{name}</a>' for name in _FILES[1:] if name in session.files)
    facts = [
        number_with_noun(len(session.runs), "run"),
        f"{totals.simulated:.0f} s simulated",
        *([links] if links else []),
    ]
    if listed < len(session.runs):
        facts.append(f"this page lists {listed} of them, those that did not end as expected first")
    return (
        f"<h1>{counts}</h1>"
        f'{_outcome_bar(totals)}<p class="quiet">{" · ".join(facts)}</p>'
        f"{_progress(session.live, len(session.runs)) if session.live else ''}"
    )


def _outcome_bar(totals: Totals) -> str:
    """Return a bar with the shares of the outcomes."""
    parts, start = "", 0
    for outcome in reversed(ORDER):
        number = totals.outcomes[outcome]
        parts += f'<rect class="{outcome.value}" x="{start}" width="{number}" height="1"/>' if number else ""
        start += number
    view = f'viewBox="0 0 {max(start, 1)} 1" preserveAspectRatio="none"'
    return f'<svg class="bar" {view} aria-hidden="true">{parts}</svg>'


def _progress(live: RunningSession, done: int) -> str:
    """Return the progress of a running session. The page reloads itself until it is paused or the session ends."""
    names = ", ".join(html_text(full_run_name(key)) for key in live.current)
    return (
        f'<p id="live" role="status"><progress max="{live.total}" value="{done}" aria-label="runs done"></progress> '
        f"{done} of {number_with_noun(live.total, 'run')} done{f', running: {names}' if names else ''} "
        '<button type="button" id="pause" aria-pressed="false">pause</button></p>'
    )


def _group_element(group: list[RunFinished], session: Session, totals: Totals, pictures: dict[RunKey, str]) -> str:
    """Return the runs of a scenario, with a heading if there are several variations, seeds or stacks."""
    ranked = sorted(group, key=_severity_order)
    elements = "\n".join(
        run_element(run, session.folder, pictures.get(run.key, ""), past_outcomes(run, session.past), len(group) > 1)
        for run in ranked
    )
    if len(group) == 1:
        return f'<div class="group">{elements}</div>'
    name = group[0].key.scenario
    good, number = totals.good[name], totals.runs[name]
    changed = sum(outcome_change(run, session.past) != "" for run in group)
    summary = f"{good} of {number} as expected" + (f", {changed} changed" if changed else "")
    opened = "" if good == number else " open"
    marks = outcome_symbols([run.outcome for run in group], "runs") if number <= MAX_MARKS else ""
    return (
        f'<details class="group many"{opened}><summary><h2 class="name">{html_text(name)}</h2>'
        f'<span class="quiet">{summary}</span>{marks}</summary>\n'
        f"{elements}\n</details>"
    )


def _severity_order(run: RunFinished) -> tuple[int, RunKey]:
    return ORDER.index(run.outcome), run.key


def _outcome_counts(totals: Totals) -> str:
    return ", ".join(
        f"{OUTCOME_SYMBOLS[outcome]} {number} {outcome.value.replace('-', ' ')}"
        for outcome in Outcome
        if (number := totals.outcomes[outcome]) or outcome is Outcome.PASSED
    )


@cache
def _asset(name: str) -> str:
    return files("simscen").joinpath("data").joinpath("suite").joinpath(name).read_text("utf-8")


def _hash(part: str) -> str:
    """Return the hash of a style or script for the content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(part.encode()).digest()).decode()}'"


_SORTS = {
    "": "failures first",
    "name": "by name",
    "simulated": "longest simulated time first",
    "wall": "longest wall time first",
    "margin": "smallest margin first",
}


def filter_form(runs: Sequence[RunFinished], past: Sequence[PastSession]) -> str:
    """Return the search field, and filters for properties with several values. Hidden without JavaScript."""
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
        _select("theme", Counter(theme(run.key) for run in runs)),
        _select("tag", Counter(tag for run in runs for tag in set(run.tags))),
        _select("stack", Counter(run.key.stack_name for run in runs)),
        _select("variation", Counter(run.key.variation for run in runs)),
    ]
    sorts = "".join(f'<option value="{value}">{label}</option>' for value, label in _SORTS.items())
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


def _select(name: str, counts: Counter[str]) -> str:
    named = sorted(value for value in counts if value)
    if not named or len(counts) < 2:
        return ""
    options = "".join(
        f'<option value="{html_text(value)}">{html_text(value)} ({counts[value]})</option>' for value in named
    )
    return f'<label>{name} <select name="{name}"><option value="">all</option>{options}</select></label>'


MAX_CHANGES = 20
_GOOD = tuple(outcome for outcome in Outcome if outcome.good)


def history_section(runs: Sequence[RunFinished], past: Sequence[PastSession]) -> str:
    """Return the section on earlier sessions, or "" if there are none."""
    if not past:
        return ""
    rows = "".join(_session_row(session) for session in past)
    return (
        '<details class="history"><summary><h2>earlier sessions</h2>'
        f"{_pass_rate_sparkline(runs, past)}{_change_counts(runs, past)}</summary>"
        '<div class="in"><table><thead><tr><th scope="col">session</th><th scope="col">as expected</th>'
        '<th scope="col">failed</th><th scope="col">errors</th><th scope="col">simulated</th></tr></thead>'
        f"<tbody>{rows}</tbody></table>{_changed_list(runs, past)}</div></details>"
    )


def _session_row(session: PastSession) -> str:
    simulated = sum(run.simulated for run in session.runs.values())
    return (
        f'<tr><th scope="row"><a href="../{quote(session.name)}/report.html">{html_text(session.name)}</a></th>'
        f"<td>{session.count(*_GOOD)} of {len(session.runs)}</td>"
        f"<td>{session.count(Outcome.FAILED)}</td><td>{session.count(Outcome.ERROR)}</td>"
        f"<td>{simulated:.0f} s</td></tr>"
    )


def _pass_rate_sparkline(runs: Sequence[RunFinished], past: Sequence[PastSession]) -> str:
    """Return a line chart of the share of runs with the expected outcome."""
    shares = [session.count(*_GOOD) / max(1, len(session.runs)) for session in reversed(past)]
    shares.append(sum(run.outcome.good for run in runs) / max(1, len(runs)))
    values = ", ".join(f"{share:.0%}" for share in shares)
    return sparkline(shares, f"share of runs as expected, oldest first: {values}", 0.0, 1.0)


def _change_counts(runs: Sequence[RunFinished], past: Sequence[PastSession]) -> str:
    worse = sum(outcome_change(run, past) != "" and not run.outcome.good for run in runs)
    better = sum(outcome_change(run, past) != "" and run.outcome.good for run in runs)
    parts = [f"{number} {word}" for number, word in ((worse, "newly failing"), (better, "newly passing")) if number]
    return f'<span class="quiet">{", ".join(parts) or "no change since the last session"}</span>'


def _changed_list(runs: Sequence[RunFinished], past: Sequence[PastSession]) -> str:
    changed = [run for run in runs if outcome_change(run, past)]
    changed.sort(key=lambda run: (run.outcome.good, run.key))
    rows = "".join(
        f'<li><a href="#{anchor(run.key)}">{html_text(full_run_name(run.key))}</a>: '
        f"{run.outcome.value.replace('-', ' ')}, "
        f"{outcome_change(run, past)}</li>"
        for run in changed[:MAX_CHANGES]
    )
    more = f"<li>and {len(changed) - MAX_CHANGES} more</li>" if len(changed) > MAX_CHANGES else ""
    return f"<ul>{rows}{more}</ul>" if rows else ""
