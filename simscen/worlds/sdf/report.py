"""Problems and notes that the SDF importer collects, each with its file, line and element."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from simscen.core.errors import InvalidInput, Problem

CODE = "SC310"
"""Error code of all problems of the importer."""


@dataclass(frozen=True)
class SourcePlace:
    """Position in a file: file name for messages, line and column from 1, path of the element, and text of the line."""

    file: str
    line: int = 0
    col: int = 0
    element: str = ""
    source: str = ""


class UnusableElement(Exception):
    """A part of a file that cannot be used; leaving it out would change the geometry."""

    is_harmless = False
    """If True, the part is left out with a note, as leaving it out cannot affect a robot."""

    def __init__(self, place: SourcePlace, message: str, hint: str = "") -> None:
        self.place, self.message, self.hint = place, message, hint
        super().__init__(f"{place.file}:{place.line}: {message}")


class OutOfReach(UnusableElement):
    """An element is so far away that no robot can reach it."""

    is_harmless = True


class MissingAsset(UnusableElement):
    """A file or model does not exist in the allowed folders."""

    def __init__(self, place: SourcePlace, message: str, hint: str, uri: str) -> None:
        super().__init__(place, message, hint)
        self.uri = uri


class ImportReport:
    """Collects problems and notes in the order in which they are found; repeated ones are kept once.

    An unusable element is a problem, or a note if `lenient`.
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

    def note(self, place: SourcePlace, message: str) -> None:
        """Add a note about something that is not an error."""
        self._notes[": ".join(part for part in (place.file, place.element, message) if part)] = None

    def add_error(self, error: UnusableElement) -> None:
        """Add an unusable element, as a problem or as a note."""
        if error.is_harmless:
            self.note(error.place, f"left out: {error.message}")
        elif self.lenient:
            self.skipped_count += 1
            self.note(error.place, f"skipped: {error.message}")
        elif isinstance(error, MissingAsset):
            self._missing.setdefault(error.uri, []).append(error)
        else:
            self._problems[_problem(error)] = None

    @contextmanager
    def skip_unusable(self) -> Iterator[None]:
        """Add an UnusableElement raised in the block and continue after it, so that one run finds all mistakes."""
        try:
            yield
        except UnusableElement as error:
            self.add_error(error)

    @property
    def has_problems(self) -> bool:
        """True if the world cannot be loaded."""
        return bool(self._problems or self._missing)

    def raise_problems(self) -> None:
        """Raise InvalidInput with all problems, if there are any."""
        if self.has_problems:
            raise InvalidInput(self._all_problems())

    def fatal_error(self, error: UnusableElement) -> InvalidInput:
        """Return the exception for an error that ends the import, even a lenient one."""
        self.lenient = False
        self.add_error(error)
        return InvalidInput(self._all_problems())

    def _all_problems(self) -> list[Problem]:
        return [*self._problems, *(_missing_asset_problem(errors) for errors in self._missing.values())]


def _problem(error: UnusableElement, suffix: str = "") -> Problem:
    place = error.place
    message = f"{place.element}: {error.message}{suffix}" if place.element else f"{error.message}{suffix}"
    return Problem(place.file, place.line, place.col, CODE, message, hint=error.hint, source=place.source)


def _missing_asset_problem(errors: list[MissingAsset]) -> Problem:
    """Return one problem for a missing asset, with the number of other places that refer to the asset."""
    count = len({error.place for error in errors}) - 1
    suffix = f" (and at {count} more place{'s' if count > 1 else ''})" if count else ""
    return _problem(errors[0], suffix)
