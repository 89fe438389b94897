"""Command that runs an external stack, from the command line or the user configuration."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass

START_TIMEOUT_S = 30.0
"""Default of `ExternalCommand.start_limit`."""
ANSWER_TIMEOUT_S = 10.0
"""Default of `ExternalCommand.answer_limit`."""


@dataclass(frozen=True)
class ExternalCommand:
    """Command that starts an external stack.

    Attributes:
        argv: The program and its arguments. The program is looked up in the PATH of `env`.
        env: Complete environment of the program.
        cwd: Working folder.
        start_limit: Maximum wall time in s until the program has started and subscribed to its topics.
        answer_limit: Maximum wall time in s of each later answer.
        digest: Hash of the arguments, of the files named in the arguments, and of the environment variables that the
            user configuration sets.
    """

    argv: tuple[str, ...]
    env: Mapping[str, str]
    cwd: str
    start_limit: float = START_TIMEOUT_S
    answer_limit: float = ANSWER_TIMEOUT_S
    digest: str = ""


def split_command(command: str) -> tuple[str, ...]:
    """Split a command line with shell quoting into words.

    Raises ValueError if a quote is not closed, or if the first word, the program, is missing or empty.
    """
    try:
        words = tuple(shlex.split(command))
    except ValueError as error:
        raise ValueError(f"cannot be read as a command: {str(error).lower()}") from error
    if not words or not words[0]:
        raise ValueError("names no program")
    return words
