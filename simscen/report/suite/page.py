"""The document: one file that holds all it needs and asks the network for nothing."""

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
    """A session that is not over: of how many runs in all, and which are under way."""

    total: int
    under_way: tuple[RunKey, ...] = ()


@dataclass(frozen=True)
class Session:
    """All that a page tells: the answers, the sessions before it, newest first, and its `folder`, for links.

    `files` are the names of what lies in the folder beside the page.
    """

    runs: Sequence[RunFinished]
    past: Sequence[PastSession] = ()
    comparison: Comparison | None = None
    folder: str = ""
    files: Sequence[str] = ()
    live: RunningSession | None = None
    title: str = "simscen"


def to_html(session: Session) -> str:
    """The page; what did not pass comes first and stands open. Pictures are read from the runs' artifacts."""
    ordered = sorted(session.runs, key=lambda run: run.key)
    groups = [list(group) for _, group in groupby(ordered, key=lambda run: run.key.scenario)]
    groups.sort(key=lambda group: min(ORDER.index(run.outcome) for run in group))
    inside = elements.embedded_pictures(
        [run for group in groups for run in sorted(group, key=_severity_order)], session.folder
    )
    groups_html = "\n".join(_group(group, session, inside) for group in groups)
    style, script = css_variables() + _asset("suite.css"), _asset("suite.js")
    counted = _outcome_counts(session.runs)
    compared = "" if session.comparison is None else as_html(session.comparison)
    return (
        f'<!doctype html>\n<html lang="en"{" data-live" if session.live else ""}>\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        f"style-src {_hash(style)}; script-src {_hash(script)}; base-uri 'none'; form-action 'none'\">\n"
        f"{'<noscript><meta http-equiv=refresh content=3></noscript>' if session.live else ''}"
        f"<title>{html_text(session.title)}: {counted}</title>\n<style>{style}</style>\n</head>\n<body>\n"
        f"<header>{_headline(session, counted)}</header>\n<main>\n"
        f"{history_section(session.runs, session.past)}{compared}\n"
        f"{sections.filter_form(session.runs, session.past)}\n"
        f'<section id="runs" aria-label="runs">\n{groups_html}\n</section>\n'
        '<p id="nothing" class="quiet" hidden>Nothing matches. <button type="button" id="all">Show all</button></p>\n'
        f"</main>\n<script>{script}</script>\n</body>\n</html>\n"
    )


def _headline(session: Session, counted: str) -> str:
    simulated = sum(run.result.simulated for run in session.runs)
    links = " · ".join(f'<a href="{name}">{name}</a>' for name in _FILES[1:] if name in session.files)
    told = [count(len(session.runs), "run"), f"{simulated:.0f} s simulated", *([links] if links else [])]
    return (
        f"<h1>{counted}</h1>"
        f'{_outcome_bar(session.runs)}<p class="quiet">{" · ".join(told)}</p>'
        f"{_progress(session.live, len(session.runs)) if session.live else ''}"
    )


def _outcome_bar(runs: Sequence[RunFinished]) -> str:
    """The outcomes as parts of a whole; the headline says the same in words."""
    parts, at = "", 0
    for outcome in reversed(ORDER):
        number = sum(run.outcome is outcome for run in runs)
        parts += f'<rect class="{outcome.value}" x="{at}" width="{number}" height="1"/>' if number else ""
        at += number
    whole = f'viewBox="0 0 {max(at, 1)} 1" preserveAspectRatio="none"'
    return f'<svg class="bar" {whole} aria-hidden="true">{parts}</svg>'


def _progress(live: RunningSession, done: int) -> str:
    """How far it is; the page comes anew every two seconds until the reader says stop, or it is over."""
    names = ", ".join(html_text(full_run_name(key)) for key in live.under_way)
    return (
        f'<p id="live" role="status"><progress max="{live.total}" value="{done}" aria-label="runs done"></progress> '
        f"{done} of {count(live.total, 'run')} done{f', under way: {names}' if names else ''} "
        '<button type="button" id="pause" aria-pressed="false">pause</button></p>'
    )


def _group(group: list[RunFinished], session: Session, inside: dict[RunKey, str]) -> str:
    """The runs of a scenario: its variations, seeds and stacks, under a heading where there are several."""
    ranked = sorted(group, key=_severity_order)
    elements = "\n".join(
        run_element(run, session.folder, inside.get(run.key, ""), past_outcomes(run, session.past), len(group) > 1)
        for run in ranked
    )
    if len(group) == 1:
        return f'<div class="group">{elements}</div>'
    good, name = sum(run.outcome.good for run in group), group[0].key.scenario
    flipped = sum(outcome_change(run, session.past) != "" for run in group)
    told = f"{good} of {len(group)} as they should be" + (f", {flipped} changed" if flipped else "")
    opened = "" if good == len(group) else " open"
    return (
        f'<details class="group many"{opened}><summary><h2 class="name">{html_text(name)}</h2>'
        f'<span class="quiet">{told}</span>{outcome_marks([run.outcome for run in group], "each run")}</summary>\n'
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
    """What a browser asks of a style or script before it takes it: nothing else on the page is run."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(part.encode()).digest()).decode()}'"
