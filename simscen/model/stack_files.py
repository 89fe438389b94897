"""The stacks that a scenario may name: simscen's own, or a process that speaks the stack protocol."""

from typing import Annotated, Any

from pydantic import AfterValidator, Discriminator, Field, StringConstraints, Tag

from simscen.core.external_command import ANSWER_TIMEOUT_S, START_TIMEOUT_S, split_command
from simscen.model.stack import InProcessStack, StackSpec
from simscen.model.stack_base import StackBase
from simscen.spec.base import LanguageVersion, Spec
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.places import Name
from simscen.spec.quantities import PositiveDuration

_TAG = "an external stack"
"""No key of a stack: problems are told by keys and tags in one path."""
StackName = Annotated[str, StringConstraints(min_length=1, max_length=60, pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$")]


class ExternalStackSpec(StackBase):
    """A stack in a process of its own, in any language, in lockstep with the simulation.

    A scenario only names it. What the name runs is told on the command line (`--stack mine='COMMAND'`) or in the
    user's own configuration, never in a scenario: a scenario stays data. Each of several robots has a process of
    its own.

    Example: `stack: {external: mine, controller_frequency: 10 Hz}`
    """

    external: StackName
    """What the command line and the user's configuration call it: letters, digits, `_`, `.` and `-`."""
    ground_truth: bool = False
    """Also tell it where it truly is, to tell faults of localization from faults of navigation."""

    @property
    def told_truth(self) -> bool:
        """Whether it is also told where it truly is."""
        return self.ground_truth


def _kind(value: Any) -> str:
    """Which stack a mapping means: an `external` one, or one by its `type`, which is left out for simscen's own."""
    if isinstance(value, dict):
        return _TAG if "external" in value and "type" not in value else str(value.get("type", "reference"))
    return _TAG if isinstance(value, ExternalStackSpec) else str(getattr(value, "type", "reference"))


_Stacks = Annotated[
    Annotated[StackSpec, Tag("reference")] | Annotated[ExternalStackSpec, Tag(_TAG)], Discriminator(_kind)
]
AnyStack = Annotated[InProcessStack | ExternalStackSpec, ExtensibleUnion("stack", _Stacks)]


# MERGED: The parameters of a stack, without a scenario around them.
class StackFileSpec(Spec):
    """A stack that `--stack NAME=FILE` runs scenarios with: a `stack:` section as a scenario has it.

    It is the whole stack: what it does not say is at its default, whatever the scenarios say. Only what is asked of any
    stack is the scenario's, in its own `stack:` section: keepout regions, speed zones, filter masks, and tolerances of
    goals where it gives them.
    """

    simscen: LanguageVersion
    """Version of this language."""
    name: Name | None = None
    """For people."""
    description: Annotated[str, Field(max_length=10_000)] = ""
    """What is special about it."""
    stack: AnyStack
    """The stack's parameters, as in a scenario."""


# MERGED: What a user says once for all sessions on their machine.
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
