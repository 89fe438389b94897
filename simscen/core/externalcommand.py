"""What the name of an external stack runs, as the command line or the user's own configuration says."""

from collections.abc import Mapping
from dataclasses import dataclass

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
