"""`simscen replay`."""

import sys
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.commands.judge import Time, wanted_of
from simscen.cli.diagnostics import harmless, print_text
from simscen.cli.session.judging import Judging
from simscen.cli.session.logs import LOGS, logs_of
from simscen.cli.session.output_files import save
from simscen.core.errors import UsageError

PAGE = "replay.html"


def command(
    runs: Annotated[
        list[Path],
        typer.Argument(help="Logs, folders of runs, or folders to search for them.", autocompletion=completions.logs),
    ],
    against: Annotated[
        Path | None, typer.Option(help="Another run to show beside it: another seed, or another stack.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="The page; default: replay.html beside run.mcap, NAME.replay.html beside any other."),
    ] = None,
    open_: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
    scenario: Annotated[
        Path | None, typer.Option(help="Judge by the criteria of this file, as `simscen judge` does.")
    ] = None,
    truth: Annotated[str | None, typer.Option(help="Of a log of others: as of `simscen judge`.")] = None,
    topic: Annotated[
        list[str] | None, typer.Option(help="NAME=TOPIC, of a log of others: as of `simscen judge`; repeatable.")
    ] = None,
    time: Annotated[Time, typer.Option(help="Of a log of others: as of `simscen judge`.")] = Time.HEADER,
    tick_rate: Annotated[int, typer.Option(min=1, max=10_000, help="Ticks a second for logs of others.")] = 1000,
    same_frame: Annotated[
        bool, typer.Option("--same-frame", help="The truth's frame is the map's, although it is called otherwise.")
    ] = False,
    root: Annotated[Path | None, typer.Option(help="Files that the scenario names stay in this folder.")] = None,
    world_path: Annotated[list[Path] | None, typer.Option(help="Folder with worlds and models; repeatable.")] = None,
) -> None:
    """Make a page that plays a recorded run, or two side by side.

    From the log alone it shows what the robot saw, believed and did at any moment, what happened when, how each signal
    went, and how the criteria came out, with the scenario's text beside it; of a run that failed, the moment at which
    it did. One file that needs no network: send it, or keep it with the log. Logs of real robots are shown as far as
    they hold the data.

    Exit code 0; 2: not a usable log, or the page cannot be written; 5: no logs found.
    """
    files = logs_of(runs)
    if len(files) > 1 and (against is not None or out is not None):
        option = "--against" if against is not None else "--out"
        raise UsageError(f"{option} is for one run, and there are {len(files)}")
    judging = Judging(wanted_of(truth, topic or [], time, tick_rate, same_frame), scenario, root, world_path or [])
    others = [] if against is None else logs_of([against])
    if len(others) > 1:
        raise UsageError(f"--against is for one run, and there are {len(others)} in {harmless(str(against))}")
    for file in files:
        page = out or file.with_name(PAGE if file.name in LOGS else f"{file.stem}.{PAGE}")
        _make(judging, [file, *others], page)
        print_text(harmless(str(page)))
        if open_:
            webbrowser.open(page.resolve().as_uri())
    for note in judging.notes:
        print_text(f"note: {harmless(note)}", sys.stderr)


def _make(judging: Judging, files: list[Path], page: Path) -> None:
    from simscen.report.replay import write_replay

    shown = [judging.shown(file) for file in files]
    save(page, lambda path: write_replay(path, shown), files)
