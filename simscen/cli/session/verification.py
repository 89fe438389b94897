"""Comparison of a run of a reconstructed scenario with the original log, for `simscen new --from-log --verify`."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from simscen.cli.diagnostics import escaped, print_text
from simscen.cli.session.user_files import save
from simscen.core.errors import Exit, RunError
from simscen.reconstruction.scenario_from_log import Reconstruction
from simscen.reconstruction.verification.comparison import Verification, compare_with_run
from simscen.reconstruction.verification.page import verification_page

PAGE_SUFFIX = ".verified.html"
"""Suffix of the file name of the page, after the name of the scenario."""
MAX_COLUMNS = 100
"""Width of the table in characters if stdout is not a terminal."""


def verify_reconstruction(reconstruction: Reconstruction) -> None:
    """Run the scenario, print a table of the differences between run and log, and write a page with both drives.

    Exit with code 1 if an incident of the log, such as a collision, does not happen in the run. Raises RunError if the
    run is not completed.
    """
    name = reconstruction.file.name.partition(".")[0]
    log = reconstruction.file.with_name(f"{name}.verified.mcap")
    _run(reconstruction.file, log)
    verified = compare_with_run(reconstruction, log)
    _print_table(verified)
    for incident in verified.incidents:
        print_text(escaped(incident.sentence))
    for new in verified.new_incidents:
        print_text(escaped(f"only in the run: {new.kind} at {new.time:.2f} s ({new.detail})"))
    if not verified.incidents and not verified.new_incidents:
        print_text("neither the log nor the run has an incident")
    failed = ", ".join(verified.failed)
    print_text(escaped(f"criteria that fail in the run: {failed}" if failed else "all criteria hold in the run"))
    page = reconstruction.file.with_name(f"{name}{PAGE_SUFFIX}")
    text = verification_page(
        reconstruction.contents.name, reconstruction.static_world, reconstruction.contents.estimated.objects, verified
    )
    save(page, lambda path: _write(path, text), [reconstruction.file, reconstruction.log])
    recorded, run = (escaped(shlex.quote(str(file))) for file in (reconstruction.log, log))
    print_text(f"log of the run: {run}; to play both: simscen replay {run} --against {recorded}")
    print_text(f"page: {escaped(str(page))}")
    if not verified.is_reproduced:
        sys.exit(Exit.FAILED)


def _run(scenario: Path, log: Path) -> None:
    """Run a scenario in another process, and copy its log to `log`. Raises RunError if the run is not completed."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        command = [sys.executable, "-m", "simscen", "run", str(scenario), "--out", str(out), "-j", "1"]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        logs = sorted(out.glob("**/run.mcap"))
        if not logs:
            raise RunError("crashed", f"the run of {scenario} was not completed", tail=done.stdout + done.stderr)
        shutil.copyfile(logs[0], log)


def _print_table(verified: Verification) -> None:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in ("quantity", "log", "run", "difference"):
        table.add_column(column)
    for row in verified.quantities:
        table.add_row(*(Text(escaped(cell)) for cell in (row.name, row.log, row.run, row.difference)))
    console = Console(file=sys.stdout, highlight=False, width=None if sys.stdout.isatty() else MAX_COLUMNS)
    console.print(table)


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
