"""Command `simscen completion`, which prints the shell completion script."""

from enum import Enum
from typing import Annotated

import typer

from simscen.cli.diagnostics import print_text
from simscen.cli.process import COMPLETION_VARIABLE


class Shell(str, Enum):
    """Supported shells."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"
    POWERSHELL = "powershell"


def command(shell: Annotated[Shell, typer.Argument(help="The shell.")] = Shell.BASH) -> None:
    """Print the shell completion script for commands, options, scenario files, and names.

    bash: add `eval "$(simscen completion bash)"` to ~/.bashrc. zsh: add `eval "$(simscen completion zsh)"` to ~/.zshrc
    after `compinit`. fish: write the script to ~/.config/fish/completions/simscen.fish.
    """
    from typer.completion import get_completion_script  # type: ignore[attr-defined]

    print_text(get_completion_script(prog_name="simscen", complete_var=COMPLETION_VARIABLE, shell=shell.value).strip())
