"""Small pieces of the page. Whatever comes from a scenario is text, never markup."""

import base64
import re
from collections.abc import Sequence
from html import escape
from pathlib import Path, PurePath
from urllib.parse import quote

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.report.display_text import one_line
from simscen.report.results_json import relative

SIGNS = {
    Outcome.PASSED: "✓",
    Outcome.FAILED: "✗",
    Outcome.ERROR: "!",
    Outcome.FAILED_AS_EXPECTED: "~",
    Outcome.SKIPPED: "–",
}


def html_text(what: str) -> str:
    """Text on one line, also for attributes between double quotes."""
    return escape(one_line(what), quote=True)


def count(number: int, noun: str) -> str:
    """1 run, 2 runs."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def pill(outcome: Outcome) -> str:
    """The outcome with its sign, so that its color need not be seen."""
    word = outcome.value.replace("-", " ")
    return f'<span class="pill {outcome.value}"><span aria-hidden="true">{SIGNS[outcome]} </span>{word}</span>'


def outcome_marks(outcomes: Sequence[Outcome | None], what: str) -> str:
    """One sign for each outcome, the oldest first; a dot where there was none."""
    told = "".join(SIGNS[outcome] if outcome else "·" for outcome in outcomes)
    words = ", ".join(outcome.value.replace("-", " ") if outcome else "not run" for outcome in outcomes)
    return f'<span class="marks" role="img" aria-label="{what}: {words}">{told}</span>'


def link(path: str, folder: str, label: str) -> str:
    """A link to a file in the session's folder; "" where it is not in there: nobody else's paths become links."""
    if not path or not folder or not PurePath(path).is_relative_to(folder) or ".." in PurePath(path).parts:
        return ""
    return f'<a href="./{quote(relative(path, folder))}">{html_text(label)}</a>'


def anchor(key: RunKey) -> str:
    """What a link to a run names it by: letters, digits and dashes, one for each run."""
    parts = [key.scenario, key.variation, f"seed-{key.seed}", key.stack_name]
    return "run-" + re.sub(r"[^\w.=]+", "-", "-".join(part for part in parts if part), flags=re.ASCII)


def sparkline(values: Sequence[float], told: str, low: float, high: float) -> str:
    """A small line through values, `low` at its foot and `high` at its top."""
    span, step = (high - low) or 1.0, 72 / max(1, len(values) - 1)
    points = [(4 + step * k, 18 - 14 * (value - low) / span) for k, value in enumerate(values)]
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    x, y = points[-1]
    return (
        f'<svg class="spark" viewBox="0 0 80 22" width="80" height="22" role="img" aria-label="{html_text(told)}">'
        f'<polyline points="{line}"/><circle cx="{x:.1f}" cy="{y:.1f}" r="2.5"/></svg>'
    )


PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
MAX_EMBEDDED_BYTES = 6 * 2**20
"""Of all pictures together; one weighs some 50 kB. Larger pages open slowly and are cut off by CI systems."""


def embedded_pictures(runs: Sequence[RunFinished], folder: str) -> dict[RunKey, str]:
    """Each run's picture, as long as there is room, in this order, then links; one that has gone since is left out."""
    shown, room = {}, MAX_EMBEDDED_BYTES
    for run in runs:
        path = Path(run.artifacts.picture)
        size = path.stat().st_size if run.artifacts.picture and path.is_file() else 0
        room -= size
        if size:
            shown[run.key] = _picture(path, run) if room >= 0 else _picture_link(path, folder)
    return shown


def _picture(path: Path, run: RunFinished) -> str:
    content = path.read_bytes()
    if not content.startswith(PNG_MAGIC):
        return ""  # a journal names files, and not whatever it names is to be seen by all who get the page
    data = base64.b64encode(content).decode("ascii")
    told = html_text(f"map of {run.key.test}, seed {run.key.seed}: {run.outcome.value.replace('-', ' ')}")
    return f'<img alt="{told}" loading="lazy" decoding="async" src="data:image/png;base64,{data}">'


def _picture_link(path: Path, folder: str) -> str:
    where = link(str(path), folder, "picture") or f"picture: <code>{html_text(str(path))}</code>"
    return f'<p class="quiet">{where} (not in this page, which would be too large)</p>'
