"""Command `simscen report`, which writes the reports of an output folder again."""

import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from simscen.cli.diagnostics import escaped, print_text
from simscen.cli.session.exit_codes import exit_code
from simscen.cli.session.output_files import Reports, require_writable_junit
from simscen.cli.session.terminal import open_screen
from simscen.cli.shared_options import Format, FormatOption, JunitFamily, JunitFamilyOption
from simscen.core.errors import Exit, UsageError
from simscen.judge.metrics.comparison import compare_stacks
from simscen.judge.metrics.session_summary import session_summary_line
from simscen.judge.study import evaluate_study
from simscen.report.journal import require_unlocked
from simscen.report.journal_reader import JournaledSession, read_journal
from simscen.report.parquet import write_parquet
from simscen.report.results_json import summaries_by_stack


def command(
    folder: Annotated[Path, typer.Argument(help="The output folder of `simscen run`.")],
    junit: Annotated[Path | None, typer.Option(help="Write only JUnit XML, to this file.")] = None,
    junit_family: JunitFamilyOption = JunitFamily.SIMSCEN,
    format_: FormatOption = Format.TEXT,
    parquet: Annotated[
        Path | None, typer.Option(help="Also write runs.parquet and verdicts.parquet into this folder; needs pyarrow.")
    ] = None,
) -> None:
    """Write the reports of an output folder again from its journal.

    The reports contain every planned run, even if simscen was killed. An unfinished run is then an error of type
    `interrupted`, and a run without a start is an error of type `not-run`. Nothing is simulated or judged again. With
    --junit, the folder is not changed.

    Exit code as for `simscen run`: 0: all passed; 1: a criterion failed; 2: not an output folder, or still in use; 3: a
    run was not completed.
    """
    require_unlocked(folder)
    session = read_journal(folder)
    require_writable_junit(junit, folder)
    if parquet is not None:
        try:
            files = write_parquet(parquet, session.runs, {run.key: run.varied for run in session.planned})
        except OSError as error:
            raise UsageError(f"cannot write to {parquet}: {error.strerror or error}") from error
        for file in files:
            print_text(f"wrote {escaped(str(file))}", sys.stderr)  # stdout may be JSON
    write_reports(session, folder, junit, junit_family, format_, only_junit=junit is not None)


def write_reports(
    session: JournaledSession,
    folder: Path,
    junit: Path | None,
    junit_family: JunitFamily,
    format_: Format,
    only_junit: bool,
) -> NoReturn:
    """Write the reports of a session to its output folder, print the session, and exit with its exit code."""
    reports = Reports(folder, junit, junit_family.value, junit_only=only_junit)
    finished_runs = session.runs
    with open_screen(format_) as screen:
        screen(session.start_event(folder))
        for finished in finished_runs:
            screen(finished)
        comparison = compare_stacks((finished.result for finished in finished_runs), session.stacks)
        results = (finished.result for finished in finished_runs)
        study = None if session.study is None else evaluate_study(session.study, results)
        written = reports.write(finished_runs, comparison, study)
        screen(reports.finished_event(finished_runs, session.wall, session.interrupted, comparison, study))
    if format_ is Format.TEXT:
        for stack, summary in summaries_by_stack(finished_runs).items():
            line = session_summary_line(summary)
            print_text(f"{stack}: {line}" if stack else line)
    code = exit_code(finished_runs, study) if written else Exit.INCOMPLETE
    sys.exit(screen.exit_code(code))
