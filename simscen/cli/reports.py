"""What `simscen run` leaves behind, results.json, junit.xml, report.html, run.json, and what it prints meanwhile."""

import json
import os
import platform
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timezone
from enum import Enum
from importlib.metadata import version
from pathlib import Path
from typing import TextIO

from simscen.cli.diagnostics import print_text
from simscen.core.session import RunFinished
from simscen.report.console import Reporter, text_reporter
from simscen.report.github import github_reporter
from simscen.report.junit import Family, to_xml
from simscen.report.machine import json_reporter
from simscen.report.page import to_html
from simscen.report.results import to_json
from simscen.run.outfolder import write_atomically

PACKAGES = ("simscen", "pybullet", "ompl", "numpy", "scipy", "embreex", "mcap", "pydantic")


class Format(str, Enum):
    """What is printed."""

    TEXT = "text"
    JSON = "json"
    GITHUB = "github"


def printer(format_: Format, summary: TextIO | None) -> Reporter:
    """What prints on stdout; `summary` is GitHub's step summary."""
    match format_:
        case Format.TEXT:
            return text_reporter(sys.stdout)
        case Format.JSON:
            return json_reporter(sys.stdout)
        case Format.GITHUB:
            return github_reporter(sys.stdout, summary)


@contextmanager
def step_summary() -> Iterator[TextIO | None]:
    """The file that GitHub Actions shows as the summary of a step, where there is one."""
    path = os.environ.get("GITHUB_STEP_SUMMARY")
    if not path:
        yield None
        return
    with Path(path).open("a", encoding="utf-8") as file:
        yield file


class Reports:
    """The reports of one session in `folder`; `junit` is the report that is named at the end."""

    def __init__(self, folder: Path, junit: Path | None, family: Family) -> None:
        self.folder, self.junit = folder, junit or folder / "junit.xml"
        self._family: Family = family

    def write(self, answers: Sequence[RunFinished], wall: float) -> bool:
        """Write all reports; a report that cannot be written is told, and the one before it stays whole."""
        documents = {
            self.folder / "results.json": to_json(answers, str(self.folder)).encode(),
            self.folder / "junit.xml": to_xml(answers, self._family),
            self.junit: to_xml(answers, self._family),
            self.folder / "report.html": to_html(answers).encode(),
            self.folder / "run.json": _circumstances(wall),
        }
        written = True
        for path, data in documents.items():
            try:
                write_atomically(path, data)
            except OSError as error:
                written = False
                print_text(f"simscen: cannot write {path}: {error.strerror}", sys.stderr)
        return written


def _circumstances(wall: float) -> bytes:
    """run.json: all that may differ between two equal sessions."""
    return json.dumps(
        {
            "ended": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "wall_seconds": round(wall, 3),
            "host": platform.node(),
            "command": sys.argv,
            "python": platform.python_version(),
            "machine": platform.machine(),
            "cores": os.cpu_count(),
            "cpu_flags": _cpu_flags(),
            "packages": {name: version(name) for name in PACKAGES},
        },
        indent=2,
    ).encode()


def _cpu_flags() -> list[str]:
    """Which of the instruction sets that change last bits this machine has."""
    known = {"fma", "avx", "avx2", "avx512f", "sse4_2"}
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    flags = next((line.split(":", 1)[1].split() for line in lines if line.startswith("flags")), [])
    return sorted(known.intersection(flags))
