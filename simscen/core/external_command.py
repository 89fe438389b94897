"""Command that runs an external stack, from the command line or the user configuration."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass

START_TIMEOUT_S = 30.0
ANSWER_TIMEOUT_S = 10.0
"""Wall time; see ExternalCommand."""


@dataclass(frozen=True)
class ExternalCommand:
    """Program that implements the stack protocol: its arguments, its whole environment, and its working folder.

    `start_limit` is the wall time in s until the program has subscribed, and `answer_limit` the wall time of each
    answer after that. The program is searched in the PATH of `env`, like in a shell. `digest` is a hash of the
    arguments, the requested variables, and the content of files among the arguments. It does not include the rest of
    the environment, which must not appear in logs or reports.
    """

    argv: tuple[str, ...]
    env: Mapping[str, str]
    cwd: str
    start_limit: float = START_TIMEOUT_S
    answer_limit: float = ANSWER_TIMEOUT_S
    digest: str = ""


def split_command(command: str) -> tuple[str, ...]:
    """Return the arguments of a command line with shell quoting. Raises ValueError with the reason."""
    try:
        words = tuple(shlex.split(command))
    except ValueError as error:
        raise ValueError(f"cannot be read as a command: {str(error).lower()}") from error
    if not words or not words[0]:
        raise ValueError("names no program")
    return words
