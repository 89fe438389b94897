"""The replay page, replay.html: a single file that plays one run, or two runs side by side.

HTML, CSS and JavaScript modules are package data. The modules are joined to one script in the order of their imports.
Tests import them one by one.
"""

import base64
import hashlib
import json
import re
import struct
import zlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from html import escape
from pathlib import Path
from typing import Any

from simscen.core.records.run_result import RunResult
from simscen.core.version import PACKAGE
from simscen.record.log_reader.read import Log
from simscen.report.picture.palette import css_variables
from simscen.report.replay.packed_columns import PackedColumns
from simscen.report.replay.run_data import run_data

FOLDER = PACKAGE / "data" / "replay"
FORMAT = 1
_IMPORT = re.compile(r'^import \{[^}]*\} from "\./([a-z]+)\.js";\n', re.MULTILINE)
_LEVEL = 6


def replay_page(runs: Sequence[tuple[Log, RunResult]]) -> bytes:
    """Return the page of one run, or of two runs to compare. Equal logs give equal bytes."""
    columns = PackedColumns()
    described = [run_data(log, result, columns) for log, result in runs]
    document = {"format": FORMAT, "runs": described, "leftOut": list(dict.fromkeys(columns.left_out))}
    data = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    title = " against ".join(_title(run) for run in described)
    return page(title, data.encode(), columns.data).encode()


def write_replay(path: Path, runs: Sequence[tuple[Log, RunResult]]) -> None:
    """Write the page to a file."""
    path.write_bytes(replay_page(runs))


def page(title: str, data: bytes, numbers: bytes) -> str:
    """Return the HTML with compressed data, and a content security policy that allows only its own script and style."""
    packed = zlib.compress(struct.pack("<I", len(data)) + data + numbers, _LEVEL)[2:-4]  # deflate without header
    parts = {name: (FOLDER / f"page.{name}").read_text(encoding="utf-8") for name in ("html", "css")}
    parts = {**parts, "css": css_variables() + parts["css"], "js": script()}
    policy = (
        f"default-src 'none'; script-src '{_digest(parts['js'])}'; style-src '{_digest(parts['css'])}'; "
        "img-src data:; base-uri 'none'; form-action 'none'; require-trusted-types-for 'script'"
    )
    filled = {"policy": policy, "title": escape(title), "style": parts["css"], "script": parts["js"]}
    filled["data"] = base64.b64encode(packed).decode("ascii")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: filled[match[1]], parts["html"])


@lru_cache(maxsize=1)
def script() -> str:
    """Return all modules as one script."""
    texts = {path.stem: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.js"))}
    modules = [re.sub(r"^export ", "", _IMPORT.sub("", texts[name]), flags=re.MULTILINE) for name in _in_order(texts)]
    return "\n".join(modules)


def _in_order(texts: Mapping[str, str]) -> list[str]:
    """Return the names of the modules, each after the modules that it imports."""
    done: list[str] = []

    def visit(name: str) -> None:
        if name not in done:
            for needed in _IMPORT.findall(texts[name]):
                visit(needed)
            done.append(name)

    visit("main")
    return done


def _title(run: Mapping[str, Any]) -> str:
    parts = [run["scenario"], f"seed {run['seed']}", run["variation"], run["stack"], run["outcome"]]
    return ", ".join(part for part in parts if part)


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}"
