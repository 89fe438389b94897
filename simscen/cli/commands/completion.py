"""`simscen completion`."""

from enum import Enum
from typing import Annotated

import typer

from simscen.cli.diagnostics import print_text
from simscen.cli.process import COMPLETE


class Shell(str, Enum):
    """Shells that can complete what is typed."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"
    POWERSHELL = "powershell"


def command(shell: Annotated[Shell, typer.Argument(help="For which shell.")] = Shell.BASH) -> None:
    """Print the script that lets a shell complete commands, options, scenario files and names.

    For bash put `eval "$(simscen completion bash)"` into ~/.bashrc, for zsh the same with `zsh` into ~/.zshrc after
    `compinit`; for fish write it to ~/.config/fish/completions/simscen.fish.
    """
    from typer.completion import get_completion_script  # type: ignore[attr-defined]

    print_text(get_completion_script(prog_name="simscen", complete_var=COMPLETE, shell=shell.value).strip())
