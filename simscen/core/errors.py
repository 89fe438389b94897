"""Every way to fail, its exit code, and who can mend it. A verdict is not an error."""

from enum import IntEnum

from simscen.core.problems import Problem


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


BROKEN = "broken-component"
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
