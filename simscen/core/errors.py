"""Exceptions of simscen with their exit codes, and problems in input files."""

import traceback
from dataclasses import dataclass
from enum import IntEnum


class Exit(IntEnum):
    """Exit codes of the command line.

    FAILED: a run failed. USAGE: the command line or an input file is invalid. INCOMPLETE: a run could not be completed.
    INTERNAL: a defect of simscen. NOTHING_SELECTED: no scenario matched the selection. UNDECIDED: too few runs to
    decide on the pass rate that a study requires, or on the failure rate of a search.
    HUNG_UP, INTERRUPTED, TERMINATED: a signal ended the command. The code is 128 plus the number of the signal.
    """

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
    """Base class of the exceptions of simscen, which end a command or a run."""

    exit = Exit.INTERNAL
    """Exit code of the command if this error ends it."""


class InvalidInput(SimscenError):
    """An input file is invalid."""

    exit = Exit.USAGE

    def __init__(self, problems: "list[Problem]") -> None:
        self.problems = sorted(problems)
        super().__init__("\n".join(f"{p.place}: {p.message}" for p in self.problems))

    def __reduce__(self) -> "tuple[type[InvalidInput], tuple[list[Problem]]]":
        """Pickle the problems, which the default would lose."""
        return type(self), (self.problems,)


class UsageError(SimscenError):
    """The command line is invalid, or the output folder is unusable."""

    exit = Exit.USAGE


class NothingSelected(SimscenError):
    """No scenario matched the selection on the command line."""

    exit = Exit.NOTHING_SELECTED


BROKEN_COMPONENT = "broken-component"
"""Value of `RunError.kind`: a component of a plug-in returned an invalid value."""


class RunError(SimscenError):
    """A run could not be completed.

    `kind` is the error type in JUnit: crashed, timeout, out-of-memory, invalid, … `tail` is the last output of the
    process that failed, such as an external stack. `by_stack` is True if the stack under test is the cause.
    """

    exit = Exit.INCOMPLETE

    def __init__(self, kind: str, message: str, tail: str = "", by_stack: bool = False) -> None:
        self.kind, self.tail, self.by_stack = kind, tail, by_stack
        super().__init__(message)

    def __reduce__(self) -> "tuple[type[RunError], tuple[str, str, str, bool]]":
        """Pickle all arguments, which the default would lose."""
        return type(self), (self.kind, str(self), self.tail, self.by_stack)


@dataclass(frozen=True, order=True)
class Problem:
    """A problem in an input file.

    `line` and `col` count from 1; both are 0 if the problem concerns the whole file. `code` identifies the kind of
    problem, such as SC012. `hint` says how to fix the problem. `severity` is "error" or "warning". `source` is the text
    of the line.
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
        """Position as path:line:col, or the path alone if the problem concerns the whole file."""
        return f"{self.path}:{self.line}:{self.col}" if self.line else self.path


def exception_place(error: BaseException, component: str = "") -> str:
    """Return "file:line" of the innermost entry of the traceback of an exception.

    If the traceback has entries in the top-level package of `component`, the innermost of these entries is used.
    `component` is the name of a module or class, such as "package.module:Class".
    """
    package = component.partition(":")[0].partition(".")[0]
    entries = list(traceback.walk_tb(error.__traceback__))
    package_entries = [
        entry for entry in entries if str(entry[0].f_globals.get("__name__", "")).partition(".")[0] == package
    ]
    frame, line = (package_entries or entries)[-1]
    return f"{frame.f_code.co_filename.rpartition('/')[2]}:{line}"
