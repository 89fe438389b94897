"""Command `simscen merge`, which merges the output folders of sessions that ran shards (parts of the scenarios)."""

from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.commands.report import write_reports
from simscen.cli.session.output_files import Reports, require_writable_junit
from simscen.cli.shared_options import Format, FormatOption, JunitFamily, JunitFamilyOption, JunitOption
from simscen.core.errors import UsageError
from simscen.report.journal import require_unlocked
from simscen.report.journal_reader import read_journal
from simscen.report.merge import merge_shards, read_shards
from simscen.run.sessions.output_folder import RUNS_FOLDER, create_output_folder


def command(
    shards: Annotated[list[Path], typer.Argument(help="Output folders of `simscen run --shard`.")],
    out: Annotated[Path, typer.Option(help="Output folder to create.")],
    allow_missing: Annotated[
        bool, typer.Option("--allow-missing", help="Merge although a shard is missing, because it had no scenarios.")
    ] = False,
    junit: JunitOption = None,
    junit_family: JunitFamilyOption = JunitFamily.SIMSCEN,
    format_: FormatOption = Format.TEXT,
) -> None:
    """Merge the output folders of shards into one.

    The reports are those that a single session with all runs would have written. Runs that a shard did not finish are
    errors, as in `simscen report`. The shards are not changed.

    Exit code as for `simscen run`: 0: all passed; 1: a criterion failed; 2: a folder is not an output folder, still in
    use, or does not match the others, or a shard is missing; 3: a run was not completed.
    """
    sessions = read_shards(shards, allow_missing)
    for shard in shards:
        require_unlocked(shard)
    require_writable_junit(junit, out)
    folder = create_output_folder(out)
    try:
        merge_shards(sessions, folder, RUNS_FOLDER)
    except OSError as error:
        raise UsageError(f"cannot write {folder}: {error.strerror}") from error
    Reports(folder, junit, junit_family.value).begin()
    write_reports(read_journal(folder), folder, junit, junit_family, format_, only_junit=False)
