"""The document of the HTML report: a single file that loads nothing from the network."""

import base64
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import groupby

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import Comparison, RunFinished
from simscen.report.comparison import as_html
from simscen.report.picture.palette import css_variables
from simscen.report.suite import elements, sections
from simscen.report.suite.elements import SIGNS, count, html_text, outcome_marks
from simscen.report.suite.history import PastSession, outcome_change, past_outcomes
from simscen.report.suite.run_entry import full_run_name, run_element
from simscen.report.suite.sections import history_section

ORDER = (Outcome.ERROR, Outcome.FAILED, Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED, Outcome.PASSED)
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
    """

    runs: Sequence[RunFinished]
    past: Sequence[PastSession] = ()
    comparison: Comparison | None = None
    folder: str = ""
    files: Sequence[str] = ()
    live: RunningSession | None = None
    title: str = "simscen"


def to_html(session: Session) -> str:
    """Return the report as HTML, with failures first and expanded. Reads the pictures of the runs."""
    ordered = sorted(session.runs, key=lambda run: run.key)
    groups = [list(group) for _, group in groupby(ordered, key=lambda run: run.key.scenario)]
    groups.sort(key=lambda group: min(ORDER.index(run.outcome) for run in group))
    pictures = elements.embedded_pictures(
        [run for group in groups for run in sorted(group, key=_severity_order)], session.folder
    )
    groups_html = "\n".join(_group(group, session, pictures) for group in groups)
    style, script = css_variables() + _asset("suite.css"), _asset("suite.js")
    counts = _outcome_counts(session.runs)
    compared = "" if session.comparison is None else as_html(session.comparison)
    return (
        f'<!doctype html>\n<html lang="en"{" data-live" if session.live else ""}>\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        f"style-src {_hash(style)}; script-src {_hash(script)}; base-uri 'none'; form-action 'none'\">\n"
        f"{'<noscript><meta http-equiv=refresh content=3></noscript>' if session.live else ''}"
        f"<title>{html_text(session.title)}: {counts}</title>\n<style>{style}</style>\n</head>\n<body>\n"
        f"<header>{_headline(session, counts)}</header>\n<main>\n"
        f"{history_section(session.runs, session.past)}{compared}\n"
        f"{sections.filter_form(session.runs, session.past)}\n"
        f'<section id="runs" aria-label="runs">\n{groups_html}\n</section>\n'
        '<p id="nothing" class="quiet" hidden>No run matches. <button type="button" id="all">Show all</button></p>\n'
        f"</main>\n<script>{script}</script>\n</body>\n</html>\n"
    )


def _headline(session: Session, counts: str) -> str:
    simulated = sum(run.result.simulated for run in session.runs)
    links = " · ".join(f'<a href="{name}">{name}</a>' for name in _FILES[1:] if name in session.files)
    facts = [count(len(session.runs), "run"), f"{simulated:.0f} s simulated", *([links] if links else [])]
    return (
        f"<h1>{counts}</h1>"
        f'{_outcome_bar(session.runs)}<p class="quiet">{" · ".join(facts)}</p>'
        f"{_progress(session.live, len(session.runs)) if session.live else ''}"
    )


def _outcome_bar(runs: Sequence[RunFinished]) -> str:
    """Return a bar with the shares of the outcomes."""
    parts, start = "", 0
    for outcome in reversed(ORDER):
        number = sum(run.outcome is outcome for run in runs)
        parts += f'<rect class="{outcome.value}" x="{start}" width="{number}" height="1"/>' if number else ""
        start += number
    view = f'viewBox="0 0 {max(start, 1)} 1" preserveAspectRatio="none"'
    return f'<svg class="bar" {view} aria-hidden="true">{parts}</svg>'


def _progress(live: RunningSession, done: int) -> str:
    """Return the progress of a running session. The page reloads itself until it is paused or the session ends."""
    names = ", ".join(html_text(full_run_name(key)) for key in live.current)
    return (
        f'<p id="live" role="status"><progress max="{live.total}" value="{done}" aria-label="runs done"></progress> '
        f"{done} of {count(live.total, 'run')} done{f', running: {names}' if names else ''} "
        '<button type="button" id="pause" aria-pressed="false">pause</button></p>'
    )


def _group(group: list[RunFinished], session: Session, pictures: dict[RunKey, str]) -> str:
    """Return the runs of a scenario, with a heading if there are several variations, seeds or stacks."""
    ranked = sorted(group, key=_severity_order)
    elements = "\n".join(
        run_element(run, session.folder, pictures.get(run.key, ""), past_outcomes(run, session.past), len(group) > 1)
        for run in ranked
    )
    if len(group) == 1:
        return f'<div class="group">{elements}</div>'
    good, name = sum(run.outcome.good for run in group), group[0].key.scenario
    flipped = sum(outcome_change(run, session.past) != "" for run in group)
    summary = f"{good} of {len(group)} as expected" + (f", {flipped} changed" if flipped else "")
    opened = "" if good == len(group) else " open"
    return (
        f'<details class="group many"{opened}><summary><h2 class="name">{html_text(name)}</h2>'
        f'<span class="quiet">{summary}</span>{outcome_marks([run.outcome for run in group], "runs")}</summary>\n'
        f"{elements}\n</details>"
    )


def _severity_order(run: RunFinished) -> tuple[int, RunKey]:
    return ORDER.index(run.outcome), run.key


def _outcome_counts(runs: Sequence[RunFinished]) -> str:
    return ", ".join(
        f"{SIGNS[outcome]} {number} {outcome.value.replace('-', ' ')}"
        for outcome in Outcome
        if (number := sum(run.outcome is outcome for run in runs)) or outcome is Outcome.PASSED
    )


@cache
def _asset(name: str) -> str:
    return files("simscen").joinpath("data").joinpath("suite").joinpath(name).read_text("utf-8")


def _hash(part: str) -> str:
    """Return the hash of a style or script for the content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(part.encode()).digest()).decode()}'"
