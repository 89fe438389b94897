"""Command-line options that the commands which simulate many runs share."""

from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.session.stacks import STACK_HELP

OutOption = Annotated[Path | None, typer.Option(help="New or empty output folder; default: simscen-out/<session id>.")]
JobsOption = Annotated[
    int | None, typer.Option("-j", "--jobs", min=1, max=256, help="Number of parallel runs; default: one per core.")
]
JunitOption = Annotated[Path | None, typer.Option(help="Also write JUnit XML to this file.")]
WallLimitOption = Annotated[float, typer.Option(min=1, help="Wall-clock limit of one run in seconds.")]
StackOption = Annotated[
    str | None, typer.Option(metavar="NAME=VALUE", autocompletion=completions.stacks, help=STACK_HELP)
]
RootOption = Annotated[Path | None, typer.Option(help="Root folder; scenarios may only refer to files below it.")]
WorldPathOption = Annotated[
    list[Path] | None, typer.Option(help="Additional folder with worlds and models; repeatable.")
]
LenientOption = Annotated[bool, typer.Option("--lenient", help="Skip unsupported parts of SDF worlds with a warning.")]
