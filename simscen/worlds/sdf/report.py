"""What an importer could not use, told with file, line and element."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from simscen.core.errors import InvalidInput
from simscen.core.problems import Problem

CODE = "SC310"
"""The stable code of every problem of this importer; the message tells them apart."""


@dataclass(frozen=True)
class Place:
    """Where something stands: the file as shown to users, line and column from 1, and the path of the element."""

    file: str
    line: int = 0
    col: int = 0
    element: str = ""
    source: str = ""


class Unusable(Exception):
    """A piece of a file that cannot be used and whose loss changes the geometry."""

    def __init__(self, place: Place, message: str, hint: str = "") -> None:
        self.place, self.message, self.hint = place, message, hint
        super().__init__(f"{place.file}:{place.line}: {message}")


class Report:
    """Collects what is wrong in the order in which it is found.

    What changes the geometry is a problem, or merely a note when `lenient`; what is harmless is a note. The same
    sentence is kept once, however often its file is included.
    """

    def __init__(self, *, lenient: bool = False) -> None:
        self.lenient = lenient
        self._problems: dict[Problem, None] = {}
        self._notes: dict[str, None] = {}

    @property
    def notes(self) -> tuple[str, ...]:
        """`file: element/path: sentence`, one for each harmless thing."""
        return tuple(self._notes)

    def note(self, place: Place, message: str) -> None:
        """Tell something that does not change the geometry."""
        self._notes[": ".join(part for part in (place.file, place.element, message) if part)] = None

    def fatal(self, error: Unusable) -> InvalidInput:
        """The error to raise when nothing can be read at all, lenient or not."""
        self.lenient = False
        self.unusable(error)
        return InvalidInput(list(self._problems))

    def unusable(self, error: Unusable) -> None:
        """Tell something that does."""
        place = error.place
        if self.lenient:
            self.note(place, f"skipped: {error.message}")
            return
        message = f"{place.element}: {error.message}" if place.element else error.message
        problem = Problem(place.file, place.line, place.col, CODE, message, hint=error.hint, source=place.source)
        self._problems[problem] = None

    @contextmanager
    def skipping(self) -> Iterator[None]:
        """Go on after this block when something in it is unusable, so that one look finds all mistakes."""
        try:
            yield
        except Unusable as error:
            self.unusable(error)

    @property
    def failed(self) -> bool:
        """Whether anything changes the geometry and may not be skipped."""
        return bool(self._problems)

    def raise_problems(self) -> None:
        """Raise InvalidInput with everything that was found, if anything was."""
        if self._problems:
            raise InvalidInput(list(self._problems))
