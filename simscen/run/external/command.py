"""What the name of an external stack runs, as the command line or the user's own configuration says."""

from collections.abc import Mapping
from dataclasses import dataclass

from simscen.core.errors import InvalidInput
from simscen.core.problems import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.messages import quoted, suggestion
from simscen.model.anystack import ExternalStackSpec

START_LIMIT = 30.0
ANSWER_LIMIT = 10.0
"""Seconds of wall time; see ExternalCommand."""


@dataclass(frozen=True)
class ExternalCommand:
    """A program that speaks the stack protocol: its words, its whole environment, and the folder it starts in.

    `start_limit` bounds in seconds of wall time how long it may take until it has said what it wants to hear,
    `answer_limit` each answer after that. The first word is looked for in the PATH of `env`, as a shell would.
    """

    argv: tuple[str, ...]
    env: Mapping[str, str]
    cwd: str
    start_limit: float = START_LIMIT
    answer_limit: float = ANSWER_LIMIT


Commands = Mapping[str, ExternalCommand]
"""Name of an external stack → what it runs."""


def command_of(loaded: LoadedScenario, commands: Commands) -> ExternalCommand | None:
    """What the stack of a scenario runs; None for one that runs in simscen itself.

    Raises InvalidInput, at the line that names the stack, when nobody says what it runs.
    """
    if problem := undefined(loaded, commands):
        raise InvalidInput([problem])
    stack = loaded.spec.stack
    return commands[stack.external] if isinstance(stack, ExternalStackSpec) else None


def undefined(loaded: LoadedScenario, commands: Commands) -> Problem | None:
    """The problem of a scenario whose external stack nobody says what it runs."""
    stack = loaded.spec.stack
    if not isinstance(stack, ExternalStackSpec) or stack.external in commands:
        return None
    name = stack.external
    near = suggestion(name, commands) if commands else ""
    hint = near if near.startswith("did") else f"say so with --stack {name}='COMMAND'"
    message = f"nobody says what the stack {quoted(name)} runs"
    return loaded.problem(("stack", "external"), "SC060", message, hint)
