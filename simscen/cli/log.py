"""`simscen log`: mend the logs of runs that broke off."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.diagnostics import harmless, print_text
from simscen.record.recover import recover as make_whole

app = typer.Typer(rich_markup_mode=None, add_completion=False, no_args_is_help=True)


@app.callback()
def _log() -> None:
    """Mend the logs of runs that broke off."""


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
