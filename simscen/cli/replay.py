"""`simscen replay`."""

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completing
from simscen.cli.diagnostics import harmless, print_text
from simscen.cli.logs import logs_of
from simscen.cli.outputs import save
from simscen.cli.recorded import log_file, said_of
from simscen.core.errors import UsageError
from simscen.core.result import RunResult
from simscen.record.replay import Log, read_run


def command(
    runs: Annotated[
        list[Path],
        typer.Argument(help="Logs, folders of runs, or folders to search for them.", autocompletion=completing.logs),
    ],
    against: Annotated[
        Path | None, typer.Option(help="Another run to show beside it: another seed, or another stack.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The page (html); default: replay.html beside the log.")] = None,
    open_: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
) -> None:
    """Make a page that plays a recorded run, or two side by side.

    From the log alone it shows what the robot saw, believed and did at any moment, what happened when, how each signal
    went, and how the criteria came out, with the scenario's text beside it; of a run that failed, the moment at which
    it did. One file that needs no network: send it, or keep it with the log.

    Exit code 0; 2: not a usable log, or the page cannot be written; 5: no logs found.
    """
    files = logs_of(runs)
    if len(files) > 1 and (against is not None or out is not None):
        option = "--against" if against is not None else "--out"
        raise UsageError(f"{option} is for one run, and there are {len(files)}")
    for file in files:
        page = out or file.with_name("replay.html")
        others = [] if against is None else [log_file(against)]
        _make([file, *others], page)
        print_text(harmless(str(page)))
        if open_:
            webbrowser.open(page.resolve().as_uri())


def _make(files: list[Path], page: Path) -> None:
    from simscen.report.replay import write_replay

    shown = [_read(file) for file in files]
    save(page, lambda path: write_replay(path, shown), files)


def _read(file: Path) -> tuple[Log, RunResult]:
    log = read_run(file, looks=True)
    return log, said_of(log, file)
