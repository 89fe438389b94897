"""Specifications of external stacks, of stack files (`--stack NAME=FILE`), and of the user configuration."""

from typing import Annotated

from pydantic import AfterValidator, Field, StringConstraints

from simscen.core.external_command import ANSWER_TIMEOUT_S, START_TIMEOUT_S, split_command
from simscen.model.stack import InProcessStack
from simscen.model.stack_base import StackBase
from simscen.spec.base import LanguageVersion, LazySpec, Spec
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.places import Name
from simscen.spec.quantities import PositiveDuration

StackName = Annotated[str, StringConstraints(min_length=1, max_length=60, pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$")]


class ExternalStackSpec(StackBase):
    """Stack in a separate process, in any language, in lockstep with the simulation.

    A scenario contains only the name of the stack. The command that starts the process is given on the command line
    (`--stack mine='COMMAND'`) or in the user configuration. With several robots, each robot has its own process.

    Example: `stack: {external: mine, controller_frequency: 10 Hz}`
    """

    external: StackName
    """Name of the stack on the command line and in the user configuration: letters, digits, `_`, `.`, and `-`."""
    ground_truth: bool = False
    """Whether to send the true pose to the stack, to test navigation without localization errors."""

    @property
    def gets_ground_truth(self) -> bool:
        """Whether the stack receives the true pose."""
        return self.ground_truth


AnyStack = Annotated[
    InProcessStack | ExternalStackSpec,
    ExtensibleUnion(
        "stack",
        default="reference",
        untyped_key="external",
        untyped=LazySpec("simscen.model.stack_files", "ExternalStackSpec"),
    ),
]
"""Stack of simscen or of an installed package, which the key `type` selects, or an external stack."""


class StackFileSpec(Spec):
    """Stack file for `--stack NAME=FILE`, which replaces the `stack` section of scenarios.

    The file cannot contain zones and masks. The zones and masks of the scenario still apply, and so do the goal
    tolerances that the scenario sets. All other parameters that the file does not set have their default values.
    """

    simscen: LanguageVersion
    """Version of the scenario language."""
    name: Name | None = None
    """Name of the stack for people. Results show NAME of `--stack NAME=FILE` instead."""
    description: Annotated[str, Field(max_length=10_000)] = ""
    """Description for people."""
    stack: AnyStack
    """Parameters of the stack, as in a scenario."""


def _check_command(text: str) -> str:
    split_command(text)
    return text


def _check_absolute(folder: str) -> str:
    if not folder.startswith(("/", "~")):
        raise ValueError(
            "expected an absolute folder or one below `~`, since this file applies to all working directories"
        )
    return folder


CommandLine = Annotated[str, StringConstraints(min_length=1, max_length=4096), AfterValidator(_check_command)]
Folder = Annotated[str, StringConstraints(min_length=1, max_length=4096), AfterValidator(_check_absolute)]
VariableName = Annotated[str, StringConstraints(max_length=200, pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
VariableValue = Annotated[str, StringConstraints(max_length=32_768, pattern=r"^[^\x00]*$")]


class StackCommandSpec(Spec):
    """Command that starts an external stack.

    Example: `stacks: {mine: {command: python3 -m my_nav --port auto, cwd: ~/my_nav}}`
    """

    command: CommandLine
    """Program and its arguments. Quotes work as in a shell; variables such as `$HOME` and patterns such as `*` do not.
    """
    env: dict[VariableName, VariableValue] = {}
    """Environment variables to add or replace."""
    cwd: Folder | None = None
    """Working directory, absolute or below `~`; default: the directory in which simscen runs."""
    start_limit: Annotated[PositiveDuration, Field(le=3600)] = START_TIMEOUT_S
    """Maximum wall-clock time until the stack is ready."""
    answer_limit: Annotated[PositiveDuration, Field(le=3600)] = ANSWER_TIMEOUT_S
    """Maximum wall-clock time of each later answer."""


class UserConfigSpec(Spec):
    """Configuration of the user, `$XDG_CONFIG_HOME/simscen/config.yaml` (`~/.config/simscen/config.yaml`)."""

    simscen: LanguageVersion = 1
    """Version of the scenario language."""
    stacks: Annotated[dict[StackName, StackCommandSpec], Field(max_length=100)] = {}
    """Commands of external stacks by name; `--stack` on the command line takes precedence."""
