"""Problems in input files, exceptions, and the exit codes of the command line. A verdict is not an error."""

from dataclasses import dataclass
from enum import IntEnum


class Exit(IntEnum):
    """The exit codes of the command line."""

    PASSED = 0
    FAILED = 1
    USAGE = 2
    INCOMPLETE = 3
    INTERNAL = 4
    NOTHING_SELECTED = 5
    HUNG_UP = 129
    INTERRUPTED = 130
    TERMINATED = 143


class SimscenError(Exception):
    """Anything that ends a command or a run on purpose."""

    exit = Exit.INTERNAL


class InvalidInput(SimscenError):
    """A file is wrong; its author can mend it. Nothing was run."""

    exit = Exit.USAGE

    def __init__(self, problems: "list[Problem]") -> None:
        self.problems = sorted(problems)
        super().__init__("\n".join(f"{p.place}: {p.message}" for p in self.problems))

    def __reduce__(self) -> "tuple[type[InvalidInput], tuple[list[Problem]]]":
        """Made anew of its problems, not of their text: it comes whole out of a process of a pool."""
        return type(self), (self.problems,)


class UsageError(SimscenError):
    """The command was called wrongly, or its output folder is unusable; the caller can mend it."""

    exit = Exit.USAGE


class NothingSelected(SimscenError):
    """No scenario matched; the caller can mend it."""

    exit = Exit.NOTHING_SELECTED


BROKEN_COMPONENT = "broken-component"
"""The kind of error of a run in which something that was installed answered with what is no answer."""


class RunError(SimscenError):
    """A run could not be completed; `kind` is JUnit's error type: crashed, timeout, out-of-memory, invalid, …

    `tail` is the end of what an external stack printed.
    """

    exit = Exit.INCOMPLETE

    def __init__(self, kind: str, message: str, tail: str = "") -> None:
        self.kind, self.tail = kind, tail
        super().__init__(message)

    def __reduce__(self) -> "tuple[type[RunError], tuple[str, str, str]]":
        """As InvalidInput."""
        return type(self), (self.kind, str(self), self.tail)


@dataclass(frozen=True, order=True)
class Problem:
    """What is wrong, where (`line` and `col` count from 1; 0 = the file as a whole), and how to mend it.

    `code` is stable (SC…); `severity` is "error" or "warning"; `source` is the text of the line for the caret.
    """

    path: str
    line: int
    col: int
    code: str
    message: str
    hint: str = ""
    severity: str = "error"
    source: str = ""

    @property
    def place(self) -> str:
        """path:line:col, or the path alone."""
        return f"{self.path}:{self.line}:{self.col}" if self.line else self.path
