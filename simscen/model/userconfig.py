"""What a user says once for all sessions on their machine."""

from typing import Annotated

from pydantic import AfterValidator, Field, StringConstraints

from simscen.core.external_command import ANSWER_TIMEOUT_S, START_TIMEOUT_S, split_command
from simscen.model.anystack import StackName
from simscen.spec.base import LanguageVersion, Spec
from simscen.spec.quantities import PositiveDuration


def _words(text: str) -> str:
    split_command(text)
    return text


def _rooted(folder: str) -> str:
    if not folder.startswith(("/", "~")):
        raise ValueError("expected an absolute folder, or one below `~`: this file is for all sessions, wherever")
    return folder


CommandLine = Annotated[str, StringConstraints(min_length=1, max_length=4096), AfterValidator(_words)]
Folder = Annotated[str, StringConstraints(min_length=1, max_length=4096), AfterValidator(_rooted)]
Variable = Annotated[str, StringConstraints(max_length=200, pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
Content = Annotated[str, StringConstraints(max_length=32_768, pattern=r"^[^\x00]*$")]


class StackCommandSpec(Spec):
    """What the name of an external stack runs.

    Example: `stacks: {mine: {command: python3 -m my_nav --port auto, cwd: ~/my_nav}}`
    """

    command: CommandLine
    """The program and its arguments as in a shell, but with nothing replaced: quotes count, `$HOME` and `*` do not."""
    env: dict[Variable, Content] = {}
    """Variables that it gets besides those, or in place of those, that simscen was called with."""
    cwd: Folder | None = None
    """The folder it starts in, absolute or below `~`; default: where simscen is called."""
    start_limit: Annotated[PositiveDuration, Field(le=3600)] = START_TIMEOUT_S
    """Wall time until it has said what it wants to hear."""
    answer_limit: Annotated[PositiveDuration, Field(le=3600)] = ANSWER_TIMEOUT_S
    """Wall time for each answer after that."""


class UserConfigSpec(Spec):
    """The user's own configuration, `$XDG_CONFIG_HOME/simscen/config.yaml` (`~/.config/simscen/config.yaml`)."""

    simscen: LanguageVersion = 1
    """Version of this language."""
    stacks: Annotated[dict[StackName, StackCommandSpec], Field(max_length=100)] = {}
    """What the names of external stacks run, unless `--stack` says so on the command line."""
