"""The last sessions on the page: how many runs passed in each, and what has changed since the one before."""

from collections.abc import Sequence
from urllib.parse import quote

from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.report.suite.bits import anchor, sparkline, text
from simscen.report.suite.history import Past, changes
from simscen.report.suite.run import run_label

MOST_CHANGES = 20
_GOOD = tuple(outcome for outcome in Outcome if outcome.good)


def history(runs: Sequence[RunFinished], past: Sequence[Past]) -> str:
    """A section; nothing where there was no session before."""
    if not past:
        return ""
    rows = "".join(_row(session) for session in past)
    return (
        '<details class="history"><summary><h2>last sessions</h2>'
        f"{_trend(runs, past)}{_changed(runs, past)}</summary>"
        '<div class="in"><table><thead><tr><th scope="col">session</th><th scope="col">as they should be</th>'
        '<th scope="col">failed</th><th scope="col">errors</th><th scope="col">simulated</th></tr></thead>'
        f"<tbody>{rows}</tbody></table>{_list(runs, past)}</div></details>"
    )


def _row(session: Past) -> str:
    simulated = sum(before.simulated for before in session.runs.values())
    return (
        f'<tr><th scope="row"><a href="../{quote(session.name)}/report.html">{text(session.name)}</a></th>'
        f"<td>{session.number(*_GOOD)} of {len(session.runs)}</td>"
        f"<td>{session.number(Outcome.FAILED)}</td><td>{session.number(Outcome.ERROR)}</td>"
        f"<td>{simulated:.0f} s</td></tr>"
    )


def _trend(runs: Sequence[RunFinished], past: Sequence[Past]) -> str:
    """The share of runs that are as they should be, session by session, as a line."""
    shares = [session.number(*_GOOD) / max(1, len(session.runs)) for session in reversed(past)]
    shares.append(sum(run.outcome.good for run in runs) / max(1, len(runs)))
    told = ", ".join(f"{share:.0%}" for share in shares)
    return sparkline(shares, f"share of runs as they should be, oldest first: {told}", 0.0, 1.0)


def _changed(runs: Sequence[RunFinished], past: Sequence[Past]) -> str:
    worse = sum(changes(run, past) != "" and not run.outcome.good for run in runs)
    better = sum(changes(run, past) != "" and run.outcome.good for run in runs)
    told = [f"{number} {word}" for number, word in ((worse, "newly failing"), (better, "newly passing")) if number]
    return f'<span class="quiet">{", ".join(told) or "no change since the last"}</span>'


def _list(runs: Sequence[RunFinished], past: Sequence[Past]) -> str:
    changed = [run for run in runs if changes(run, past)]
    changed.sort(key=lambda run: (run.outcome.good, run.key))
    rows = "".join(
        f'<li><a href="#{anchor(run.key)}">{text(run_label(run.key))}</a>: {run.outcome.value.replace("-", " ")}, '
        f"{changes(run, past)}</li>"
        for run in changed[:MOST_CHANGES]
    )
    more = f"<li>and {len(changed) - MOST_CHANGES} more</li>" if len(changed) > MOST_CHANGES else ""
    return f"<ul>{rows}{more}</ul>" if rows else ""
