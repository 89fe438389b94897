"""Implementation of `simscen new --from-log`, which reconstructs a scenario from a drive, and verifies it by a run."""

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

from simscen.cli.diagnostics import escaped, paths_from_working_folder, print_text
from simscen.cli.session.backends import interrupt_on_signals
from simscen.cli.session.user_files import create_file, require_writable, save
from simscen.cli.shared_options import parse_topics
from simscen.core.errors import Exit, InvalidInput, Problem, RunError
from simscen.loading.files.discovery import default_root
from simscen.reconstruction.drive.log_messages import TOPIC_ROLES
from simscen.reconstruction.scenario.given_parts import GivenFiles
from simscen.reconstruction.scenario_from_log import Reconstruction, ReconstructionOptions, scenario_from_log
from simscen.reconstruction.verification.comparison import Verification, compare_with_run
from simscen.reconstruction.verification.page import verification_page

PIPED_COLUMNS = 100
"""Width of the table in characters if stdout is not a terminal."""


def write_scenario_from_log(
    log: Path, out: Path, files: GivenFiles, truth: str | None, topics: list[str], root: Path | None, verify: bool
) -> None:
    """Write the scenario `out` and print a summary. With `verify`, also compare a run of the scenario with the log.

    `log` is an MCAP file or a rosbag2 folder. The other parameters are the options of `simscen new` with these names;
    `files` are the values of --world, --map, and --robot. Raises InvalidInput if the log or another file is unusable,
    and UsageError if the scenario cannot be written.
    """
    if not log.exists():
        raise InvalidInput([Problem(str(log), 0, 0, "SC001", "no such file or directory")])
    options = ReconstructionOptions(truth, parse_topics(topics, TOPIC_ROLES), files, root)
    with create_file(out, str(out)), paths_from_working_folder(default_root([out])):
        reconstruction = scenario_from_log(log, out, options)
    for file in reconstruction.files[1:]:
        print_text(f"wrote {escaped(str(file))}")
    for line in reconstruction.summary():
        print_text(escaped(line))
    print_text(f"wrote {escaped(str(out))}; try: simscen run {escaped(shlex.quote(str(out)))}")
    for unknown in reconstruction.contents.unknowns:
        print_text(f"note: the log does not show: {escaped(unknown)}", sys.stderr)
    if verify:
        _verify(reconstruction)


def _verify(reconstruction: Reconstruction) -> None:
    """Run the scenario, print a table of the differences between run and log, and write a page with both drives.

    Exit with code 1 if an incident of the log, such as a collision, does not happen in the run. Raises RunError if the
    run is not completed.
    """
    name = reconstruction.file.name.partition(".")[0]
    log = reconstruction.file.with_name(f"{name}.verified.mcap")
    _run(reconstruction.file, log, reconstruction.log)
    verified = compare_with_run(reconstruction, log)
    _print_table(verified)
    for incident in verified.incidents:
        print_text(escaped(incident.sentence))
    for new in verified.new_incidents:
        print_text(escaped(f"only in the run: {new.kind} at {new.time:.2f} s ({new.detail})"))
    if not verified.incidents and not verified.new_incidents:
        print_text("neither the log nor the run has an incident")
    failed = ", ".join(verified.failed_criteria)
    print_text(escaped(f"criteria that fail in the run: {failed}" if failed else "all criteria hold in the run"))
    page = reconstruction.file.with_name(f"{name}.verified.html")
    text = verification_page(
        reconstruction.contents.name, reconstruction.static_world, reconstruction.contents.estimated.objects, verified
    )
    save(page, lambda path: path.write_text(text, encoding="utf-8"), [reconstruction.file, reconstruction.log])
    recorded, run = (escaped(shlex.quote(str(file))) for file in (reconstruction.log, log))
    print_text(f"log of the run: {run}; to play both: simscen replay {run} --against {recorded}")
    print_text(f"page: {escaped(str(page))}")
    if not verified.is_reproduced:
        sys.exit(Exit.FAILED)


def _run(scenario: Path, log: Path, recorded: Path) -> None:
    """Run a scenario in another process, and copy its log to `log`.

    Raises RunError if the run is not completed, and UsageError if `log` is the `recorded` log or cannot be written.
    """
    require_writable(log, [recorded])
    with interrupt_on_signals(), tempfile.TemporaryDirectory(prefix="simscen-") as folder:
        out = Path(folder) / "out"
        command = [sys.executable, "-m", "simscen", "run", str(scenario), "--out", str(out), "-j", "1"]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        logs = sorted(out.glob("**/run.mcap"))
        if not logs:
            raise RunError("crashed", f"the run of {scenario} was not completed", tail=done.stdout + done.stderr)
        save(log, lambda file: shutil.copyfile(logs[0], file), [recorded])


def _print_table(verified: Verification) -> None:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in ("quantity", "log", "run", "difference"):
        table.add_column(column)
    for row in verified.quantities:
        table.add_row(*(Text(escaped(cell)) for cell in (row.name, row.log, row.run, row.difference)))
    console = Console(file=sys.stdout, highlight=False, width=None if sys.stdout.isatty() else PIPED_COLUMNS)
    console.print(table)
