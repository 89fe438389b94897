"""Problems and notes of the SDF importer, with file, line and element."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from simscen.core.errors import InvalidInput, Problem

PROBLEM_CODE = "SC310"


@dataclass(frozen=True)
class SourceLocation:
    """Position of an element in a file, for messages.

    line, col:  position from 1; 0 if unknown
    element:    path of the element, for example world[default]/model[shelf]
    source:     text of the line
    """

    file: str
    line: int = 0
    col: int = 0
    element: str = ""
    source: str = ""


class UnusableElement(Exception):
    """An element cannot be used, although it may affect the geometry."""

    is_harmless = False
    """Whether the element is left out with a note instead of a problem, because it cannot affect a robot."""

    def __init__(self, location: SourceLocation, message: str, hint: str = "") -> None:
        self.location, self.message, self.hint = location, message, hint
        super().__init__(f"{location.file}:{location.line}: {message}")


class OutOfReach(UnusableElement):
    """An element is so far away that no robot can reach it."""

    is_harmless = True


class MissingAsset(UnusableElement):
    """A file or model does not exist in the allowed folders. The message begins with its URI."""


class ImportReport:
    """Collects problems and notes in the order in which they are found, without repetitions; missing files come last.

    An unusable element is a problem. If `lenient`, the element is only noted, and counted in `skipped_count`.
    """

    def __init__(self, *, lenient: bool = False) -> None:
        self.lenient, self.skipped_count = lenient, 0
        self._problems: dict[Problem, None] = {}
        self._notes: dict[str, None] = {}
        self._missing: dict[str, list[MissingAsset]] = {}

    @property
    def notes(self) -> tuple[str, ...]:
        """All notes as `file: element/path: sentence`."""
        return tuple(self._notes)

    def note(self, location: SourceLocation, message: str) -> None:
        """Add a note about the element at `location`."""
        self._notes[": ".join(part for part in (location.file, location.element, message) if part)] = None

    def add_error(self, error: UnusableElement) -> None:
        """Add an unusable element, as a problem or as a note."""
        if error.is_harmless:
            self.note(error.location, f"left out: {error.message}")
        elif self.lenient:
            self.skipped_count += 1
            self.note(error.location, f"skipped: {error.message}")
        elif isinstance(error, MissingAsset):
            self._missing.setdefault(error.message, []).append(error)
        else:
            self._problems[_problem(error)] = None

    @contextmanager
    def skip_unusable(self) -> Iterator[None]:
        """Catch an UnusableElement that is raised in the block, and add it to the report."""
        try:
            yield
        except UnusableElement as error:
            self.add_error(error)

    @property
    def has_problems(self) -> bool:
        """Whether there are problems, so that the world cannot be loaded."""
        return bool(self._problems or self._missing)

    def raise_problems(self) -> None:
        """Raise InvalidInput with all problems, if there are any."""
        if self.has_problems:
            raise InvalidInput(self._all_problems())

    def fatal_error(self, error: UnusableElement) -> InvalidInput:
        """Return an InvalidInput with all problems and this error, even if the import is lenient."""
        self.lenient = False
        self.add_error(error)
        return InvalidInput(self._all_problems())

    def _all_problems(self) -> list[Problem]:
        return [*self._problems, *(_problem(*errors) for errors in self._missing.values())]


def _problem(*errors: UnusableElement) -> Problem:
    """Return the problem of an unusable element, or of several elements that refer to the same missing file."""
    first, location = errors[0], errors[0].location
    message = f"{location.element}: {first.message}" if location.element else first.message
    if more_count := len({error.location for error in errors}) - 1:
        message += f" (and at {more_count} more place{'s' if more_count > 1 else ''})"
    return Problem(
        location.file, location.line, location.col, PROBLEM_CODE, message, hint=first.hint, source=location.source
    )
