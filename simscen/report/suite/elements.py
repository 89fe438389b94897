"""HTML elements of report.html: links, outcome symbols, line charts, and pictures. The functions escape text."""

import base64
import re
from collections.abc import Sequence
from pathlib import Path, PurePath
from urllib.parse import quote

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.report.display_text import html_text, relative_path
from simscen.report.session_lines import SYMBOLS

OUTCOME_SYMBOLS = {outcome: symbol for outcome, (symbol, _) in SYMBOLS.items()}


def outcome_badge(outcome: Outcome) -> str:
    """Return an outcome as a symbol and a word."""
    word = outcome.value.replace("-", " ")
    return (
        f'<span class="pill {outcome.value}"><span aria-hidden="true">{OUTCOME_SYMBOLS[outcome]} </span>{word}</span>'
    )


def outcome_symbols(outcomes: Sequence[Outcome | None], label: str) -> str:
    """Return one symbol per outcome in order, with a dot for None (no run). `label` is for screen readers."""
    symbols = "".join(OUTCOME_SYMBOLS[outcome] if outcome else "·" for outcome in outcomes)
    words = ", ".join(outcome.value.replace("-", " ") if outcome else "not run" for outcome in outcomes)
    return f'<span class="marks" role="img" aria-label="{html_text(label)}: {words}">{symbols}</span>'


def link(path: str, folder: str, label: str) -> str:
    """Return a link to a file in the output `folder` of the session; "" for a file outside of the folder."""
    target = address(path, folder)
    return f'<a href="{target}">{html_text(label)}</a>' if target else ""


def address(path: str, folder: str) -> str:
    """Return the relative URL of a file in the output `folder` of the session; "" for a file outside of the folder."""
    if not path or not folder or not PurePath(path).is_relative_to(folder) or ".." in PurePath(path).parts:
        return ""
    return f"./{quote(relative_path(path, folder))}"


def anchor(key: RunKey) -> str:
    """Return the HTML ID of the entry of a run, such as "run-faults-lidar_off-seed-7"."""
    parts = [key.scenario, key.variation, f"seed-{key.seed}", key.stack_name]
    return "run-" + re.sub(r"[^\w.=]+", "-", "-".join(part for part in parts if part), flags=re.ASCII)


def sparkline(values: Sequence[float], label: str, low: float, high: float) -> str:
    """Return a small line chart (SVG) with a vertical axis from `low` to `high`. `label` is for screen readers."""
    span, step = (high - low) or 1.0, 72 / max(1, len(values) - 1)
    points = [(4 + step * k, 18 - 14 * (value - low) / span) for k, value in enumerate(values)]
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    x, y = points[-1]
    return (
        f'<svg class="spark" viewBox="0 0 80 22" width="80" height="22" role="img" aria-label="{html_text(label)}">'
        f'<polyline points="{line}"/><circle cx="{x:.1f}" cy="{y:.1f}" r="2.5"/></svg>'
    )


PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
MAX_EMBEDDED_BYTES = 6 * 2**20
"""Maximum size of all embedded pictures together."""


def embedded_pictures(runs: Sequence[RunFinished], folder: str) -> dict[RunKey, str]:
    """Return the HTML of each run's picture by run key, without runs that have no picture.

    Pictures are embedded in the order of `runs` until MAX_EMBEDDED_BYTES are reached. Further pictures become links.
    """
    pictures, available = {}, MAX_EMBEDDED_BYTES
    for run in runs:
        path = Path(run.artifacts.picture)
        size = path.stat().st_size if run.artifacts.picture and path.is_file() else 0
        available -= size
        if size:
            pictures[run.key] = _embedded_picture(path, run) if available >= 0 else _picture_link(path, folder)
    return pictures


def _embedded_picture(path: Path, run: RunFinished) -> str:
    """Return an <img> element with the picture as a data URL; "" for a file that is not a PNG."""
    content = path.read_bytes()
    if not content.startswith(PNG_MAGIC):
        return ""  # do not embed other files that a manipulated journal names
    data = base64.b64encode(content).decode("ascii")
    alt = html_text(f"map of {run.key.test}, seed {run.key.seed}: {run.outcome.value.replace('-', ' ')}")
    return f'<img alt="{alt}" loading="lazy" decoding="async" src="data:image/png;base64,{data}">'


def _picture_link(path: Path, folder: str) -> str:
    target = link(str(path), folder, "picture") or f"picture: <code>{html_text(str(path))}</code>"
    return f'<p class="quiet">{target} (not embedded, because the page would be too large)</p>'
