"""The pictures that are inside the page."""

import base64
from collections.abc import Sequence
from pathlib import Path

from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import RunFinished
from simscen.report.suite.bits import link, text

PNG = b"\x89PNG\r\n\x1a\n"
MOST_BYTES = 6 * 2**20
"""Of all pictures together; one weighs some 50 kB. Larger pages open slowly and are cut off by CI systems."""


def inside(runs: Sequence[RunFinished], folder: str) -> dict[RunKey, str]:
    """Each run's picture, as long as there is room, in this order, then links; one that has gone since is left out."""
    shown, room = {}, MOST_BYTES
    for run in runs:
        path = Path(run.artifacts.picture)
        size = path.stat().st_size if run.artifacts.picture and path.is_file() else 0
        room -= size
        if size:
            shown[run.key] = _picture(path, run) if room >= 0 else _elsewhere(path, folder)
    return shown


def _picture(path: Path, run: RunFinished) -> str:
    content = path.read_bytes()
    if not content.startswith(PNG):
        return ""  # a journal names files, and not whatever it names is to be seen by all who get the page
    data = base64.b64encode(content).decode("ascii")
    told = text(f"map of {run.key.test}, seed {run.key.seed}: {run.outcome.value.replace('-', ' ')}")
    return f'<img alt="{told}" loading="lazy" decoding="async" src="data:image/png;base64,{data}">'


def _elsewhere(path: Path, folder: str) -> str:
    where = link(str(path), folder, "picture") or f"picture: <code>{text(str(path))}</code>"
    return f'<p class="quiet">{where} (not in this page, which would be too large)</p>'
