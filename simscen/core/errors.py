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
    UNDECIDED = 6
    HUNG_UP = 129
    INTERRUPTED = 130
    TERMINATED = 143


class SimscenError(Exception):
    """Error that ends a command or a run on purpose."""

    exit = Exit.INTERNAL


class InvalidInput(SimscenError):
    """An input file is invalid, and its author can fix it. Nothing was run."""

    exit = Exit.USAGE

    def __init__(self, problems: "list[Problem]") -> None:
        self.problems = sorted(problems)
        super().__init__("\n".join(f"{p.place}: {p.message}" for p in self.problems))

    def __reduce__(self) -> "tuple[type[InvalidInput], tuple[list[Problem]]]":
        """Pickle the problems instead of the message, so that the error survives the return from a worker process."""
        return type(self), (self.problems,)


class UsageError(SimscenError):
    """The command line is invalid or the output folder is unusable; the caller can fix it."""

    exit = Exit.USAGE


class NothingSelected(SimscenError):
    """No scenario matched the selection; the caller can fix it."""

    exit = Exit.NOTHING_SELECTED


BROKEN_COMPONENT = "broken-component"
"""Error kind of a run in which a component of a plug-in returned an invalid value."""


class RunError(SimscenError):
    """A run could not be completed; `kind` is JUnit's error type: crashed, timeout, out-of-memory, invalid, …

    `tail` is the end of the output of an external stack. `by_stack`: the stack under test is the cause.
    """

    exit = Exit.INCOMPLETE

    def __init__(self, kind: str, message: str, tail: str = "", by_stack: bool = False) -> None:
        self.kind, self.tail, self.by_stack = kind, tail, by_stack
        super().__init__(message)

    def __reduce__(self) -> "tuple[type[RunError], tuple[str, str, str, bool]]":
        """Pickle all arguments, as in InvalidInput."""
        return type(self), (self.kind, str(self), self.tail, self.by_stack)


@dataclass(frozen=True, order=True)
class Problem:
    """A problem in an input file: message, position (`line` and `col` from 1; 0 for the whole file), and hint.

    `code` is stable (SC…). `severity` is "error" or "warning". `source` is the text of the line, shown with a caret.
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
        """The position as path:line:col, or the path alone."""
        return f"{self.path}:{self.line}:{self.col}" if self.line else self.path
