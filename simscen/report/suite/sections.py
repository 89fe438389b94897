"""Sections of the HTML report above the runs: filters and history."""

from collections import Counter
from collections.abc import Sequence
from urllib.parse import quote

from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.report.suite.elements import SIGNS, anchor, html_text, sparkline
from simscen.report.suite.history import PastSession, outcome_change
from simscen.report.suite.run_entry import full_run_name, theme

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
        f"{SIGNS[outcome]} {number[outcome]} {outcome.value.replace('-', ' ')}</label>"
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


def _select(name: str, found: Counter[str]) -> str:
    named = sorted(value for value in found if value)
    if not named or len(found) < 2:
        return ""
    options = "".join(
        f'<option value="{html_text(value)}">{html_text(value)} ({found[value]})</option>' for value in named
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
        f"<td>{session.number(*_GOOD)} of {len(session.runs)}</td>"
        f"<td>{session.number(Outcome.FAILED)}</td><td>{session.number(Outcome.ERROR)}</td>"
        f"<td>{simulated:.0f} s</td></tr>"
    )


def _pass_rate_sparkline(runs: Sequence[RunFinished], past: Sequence[PastSession]) -> str:
    """Return a line chart of the share of runs with the expected outcome."""
    shares = [session.number(*_GOOD) / max(1, len(session.runs)) for session in reversed(past)]
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
