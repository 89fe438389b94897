"""What the name of an external stack runs, as the command line or the user's own configuration says."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass

START_TIMEOUT_S = 30.0
ANSWER_TIMEOUT_S = 10.0
"""Seconds of wall time; see ExternalCommand."""


@dataclass(frozen=True)
class ExternalCommand:
    """A program that speaks the stack protocol: its words, its whole environment, and the folder it starts in.

    `start_limit` bounds in seconds of wall time how long it may take until it has said what it wants to hear,
    `answer_limit` each answer after that. The first word is looked for in the PATH of `env`, as a shell would.
    `digest` changes with what is run: the words, the variables that were asked for, and the content of files among the
    words. The environment as such is not part of it, and nothing of it belongs into a log or a report.
    """

    argv: tuple[str, ...]
    env: Mapping[str, str]
    cwd: str
    start_limit: float = START_TIMEOUT_S
    answer_limit: float = ANSWER_TIMEOUT_S
    digest: str = ""


def split_command(command: str) -> tuple[str, ...]:
    """The words of a command line, quotes counting as in a shell. Raises ValueError with what is wrong with it."""
    try:
        words = tuple(shlex.split(command))
    except ValueError as error:
        raise ValueError(f"cannot be read as a command: {str(error).lower()}") from error
    if not words or not words[0]:
        raise ValueError("names no program")
    return words
