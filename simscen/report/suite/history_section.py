"""Section of the HTML report about earlier sessions: a table of their outcomes, and the runs that have changed."""

from collections.abc import Sequence
from urllib.parse import quote

from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.report.display_text import html_text
from simscen.report.session_history import PastSession, outcome_change
from simscen.report.suite.elements import anchor, sparkline
from simscen.report.suite.run_entry import full_run_name

MAX_CHANGES = 20
"""Maximum number of listed runs whose outcome has changed."""
_GOOD_OUTCOMES = tuple(outcome for outcome in Outcome if outcome.is_good)


def history_html(runs: Sequence[RunFinished], past: Sequence[PastSession], good_share: float) -> str:
    """Return the section; "" if `past`, the earlier sessions (newest first), is empty.

    `runs` are the runs of this session that the page lists. `good_share` is the fraction of good outcomes of all runs
    of this session.
    """
    if not past:
        return ""
    rows = "".join(_session_row(session) for session in past)
    changed = [run for run in runs if outcome_change(run, past)]
    worse = sum(not run.outcome.is_good for run in changed)
    counts = [(worse, "newly failing"), (len(changed) - worse, "newly passing")]
    changes = ", ".join(f"{number} {word}" for number, word in counts if number) or "no change since the last session"
    return (
        '<details class="history"><summary><h2>earlier sessions</h2>'
        f"{_pass_rate_sparkline(good_share, past)}"
        f'<span class="quiet">{changes}</span></summary>'
        '<div class="in"><table><thead><tr><th scope="col">session</th><th scope="col">as expected</th>'
        '<th scope="col">failed</th><th scope="col">errors</th><th scope="col">simulated</th></tr></thead>'
        f"<tbody>{rows}</tbody></table>{_changed_list(changed, past)}</div></details>"
    )


def _session_row(session: PastSession) -> str:
    simulated = sum(run.simulated for run in session.runs.values())
    return (
        f'<tr><th scope="row"><a href="../{quote(session.name)}/report.html">{html_text(session.name)}</a></th>'
        f"<td>{session.count(*_GOOD_OUTCOMES)} of {len(session.runs)}</td>"
        f"<td>{session.count(Outcome.FAILED)}</td><td>{session.count(Outcome.ERROR)}</td>"
        f"<td>{simulated:.0f} s</td></tr>"
    )


def _pass_rate_sparkline(good_share: float, past: Sequence[PastSession]) -> str:
    """Return a line chart of the fraction of good outcomes in the earlier sessions and in this session."""
    shares = [session.count(*_GOOD_OUTCOMES) / max(1, len(session.runs)) for session in reversed(past)]
    shares.append(good_share)
    values = ", ".join(f"{share:.0%}" for share in shares)
    return sparkline(shares, f"share of runs as expected, oldest first: {values}", 0.0, 1.0)


def _changed_list(changed: Sequence[RunFinished], past: Sequence[PastSession]) -> str:
    """Return a list of the runs whose outcome has changed, failures first, with links to their entries."""
    ordered = sorted(changed, key=lambda run: (run.outcome.is_good, run.key))
    rows = "".join(
        f'<li><a href="#{anchor(run.key)}">{html_text(full_run_name(run.key))}</a>: '
        f"{run.outcome.value.replace('-', ' ')}, "
        f"{outcome_change(run, past)}</li>"
        for run in ordered[:MAX_CHANGES]
    )
    more = f"<li>and {len(changed) - MAX_CHANGES} more</li>" if len(changed) > MAX_CHANGES else ""
    return f"<ul>{rows}{more}</ul>" if rows else ""
