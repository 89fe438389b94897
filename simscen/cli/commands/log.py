"""Command `simscen log`, which recovers damaged logs, and writes layouts for viewers."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import escaped, print_text
from simscen.cli.session.user_files import save
from simscen.core.errors import UsageError
from simscen.record.log_recovery import recover as recover_log

app = typer.Typer(rich_markup_mode=None, add_completion=False, no_args_is_help=True)


@app.callback()
def _log() -> None:
    """Recover damaged logs and write layouts for viewers."""


@app.command()
def recover(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="The run.partial.mcap of an aborted run.")],
) -> None:
    """Repair a truncated log in place, so that every MCAP reader can open it.

    The run still counts as aborted. `simscen run` repairs the logs of crashed runs by itself; use this command if
    simscen was killed or the disk was full. Exit code 0: the log is complete; 2: not a log; 3: the disk is full.
    """
    name = shlex.quote(str(log))
    print_text(escaped(f"{name}: recovered" if recover_log(log) else f"{name}: complete, nothing to recover"))


@app.command()
def layout(
    log: Annotated[
        Path | None,
        typer.Argument(
            metavar="LOG",
            help="Include the robots and lidars of this log; default: the usual names.",
            autocompletion=completions.logs,
        ),
    ] = None,
    rviz: Annotated[
        bool, typer.Option("--rviz", help="Write an RViz configuration; it is the same for all logs.")
    ] = False,
    out: Annotated[Path | None, typer.Option(help="Output file; default: standard output.")] = None,
) -> None:
    """Print or write a layout for Foxglove and Lichtblick, or a configuration for RViz.

    The layout shows truth and belief from above with particles, scans, plans, costmaps, obstacles, and zones, plots of
    speed and clearance, and the events. In Foxglove, choose Layouts, "Import from file…". Exit code 0: written; 2: the
    log is unusable, or the file cannot be written.
    """
    from simscen.record.log_reader import read_log
    from simscen.report.viewer_layouts import foxglove_layout, rviz_config

    if rviz and log is not None:
        raise UsageError("--rviz takes no log: the RViz configuration is the same for all logs")
    text = rviz_config() if rviz else foxglove_layout(read_log(log, with_sensors=True) if log else None)
    if out is None:
        print(text, end="")
    else:
        save(out, lambda path: path.write_text(text, "utf-8"), [log] if log else [])
        print_text(escaped(str(out)))
