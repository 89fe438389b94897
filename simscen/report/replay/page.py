"""replay.html: one file that plays a run, or two side by side; nothing is loaded from elsewhere.

The page's own parts are package data. Its modules are put into one script in the order in which they need each other;
`import` and `export` are for the tests, which load them one by one.
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
    """The page of a run, or of two to be compared. Equal logs give equal bytes."""
    columns = PackedColumns()
    described = [run_data(log, result, columns) for log, result in runs]
    whole = {"format": FORMAT, "runs": described, "leftOut": list(dict.fromkeys(columns.left_out))}
    about = json.dumps(whole, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    title = " against ".join(_title(run) for run in described)
    return page(title, about.encode(), columns.data).encode()


def write_replay(path: Path, runs: Sequence[tuple[Log, RunResult]]) -> None:
    """Make the page and write it."""
    path.write_bytes(replay_page(runs))


def page(title: str, about: bytes, numbers: bytes) -> str:
    """The file: its parts, with a policy that lets nothing but them work, and the data as one block of text."""
    packed = zlib.compress(struct.pack("<I", len(about)) + about + numbers, _LEVEL)[2:-4]  # as deflate alone
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
    """All modules as one."""
    texts = {path.stem: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.js"))}
    own = [re.sub(r"^export ", "", _IMPORT.sub("", texts[name]), flags=re.MULTILINE) for name in _in_order(texts)]
    return "\n".join(own)


def _in_order(texts: Mapping[str, str]) -> list[str]:
    """Each module after those that it imports."""
    done: list[str] = []

    def visit(name: str) -> None:
        if name not in done:
            for needed in _IMPORT.findall(texts[name]):
                visit(needed)
            done.append(name)

    visit("main")
    return done


def _title(run: Mapping[str, Any]) -> str:
    said = [run["scenario"], f"seed {run['seed']}", run["variation"], run["stack"], run["outcome"]]
    return ", ".join(part for part in said if part)


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}"
