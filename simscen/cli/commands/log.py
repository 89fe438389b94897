"""`simscen log`: what is done with logs themselves."""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import harmless, print_text
from simscen.cli.session.output_files import save
from simscen.core.errors import UsageError
from simscen.record.recover import recover as make_whole

app = typer.Typer(rich_markup_mode=None, add_completion=False, no_args_is_help=True)


@app.callback()
def _log() -> None:
    """Mend logs, and lay out what viewers show of them."""


@app.command()
def recover(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The run.partial.mcap of a run that broke off.")],
) -> None:
    """Make a log that was cut off whole, so that every MCAP reader opens it.

    What was written up to the cut is kept, in the same file; the run stays one that broke off. `simscen run` does the
    same for runs that crash, so that this is for logs that simscen itself could not finish: it was killed, or the disk
    was full. Exit code 0; 2: not a log; 3: there is no room for it.
    """
    name = shlex.quote(str(log))
    print_text(harmless(f"{name}: made whole" if make_whole(log) else f"{name}: nothing to mend, it is whole"))


@app.command()
def layout(
    log: Annotated[
        Path | None,
        typer.Argument(
            metavar="LOG",
            help="A log, whose robots and lidars are then in the layout; else those of most logs are.",
            autocompletion=completions.logs,
        ),
    ] = None,
    rviz: Annotated[bool, typer.Option("--rviz", help="RViz's configuration; it is the same for all logs.")] = False,
    out: Annotated[Path | None, typer.Option(help="The file; else it is printed.")] = None,
) -> None:
    """Print or write the layout with which Foxglove and Lichtblick show logs, or RViz's.

    Truth and belief from above, with particles, scans, plans, costmaps, things and zones; plots of speed and clearance;
    and what happened. Import it there: Layouts, "Import from file…". Exit code 0; 2: not a usable log, or the file
    cannot be written.
    """
    from simscen.record.replay import read_log
    from simscen.report.viewers import foxglove_layout, rviz_config

    if rviz and log is not None:
        raise UsageError("--rviz takes no log: RViz's configuration is the same for all")
    text = rviz_config() if rviz else foxglove_layout(read_log(log, looks=True) if log else None)
    if out is None:
        print(text, end="", file=sys.stdout)
    else:
        save(out, lambda path: _write(path, text), [log] if log else [])
        print_text(harmless(str(out)))


def _write(path: Path, text: str) -> None:
    path.write_text(text, "utf-8")
