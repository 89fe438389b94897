"""What an importer could not use, told with file, line and element."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from simscen.core.errors import InvalidInput, Problem

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

    harmless = False
    """Whether nobody will miss it."""

    def __init__(self, place: Place, message: str, hint: str = "") -> None:
        self.place, self.message, self.hint = place, message, hint
        super().__init__(f"{place.file}:{place.line}: {message}")


class OutOfReach(Unusable):
    """Something so far away that no robot gets there."""

    harmless = True


class Missing(Unusable):
    """A file or model that is nowhere in the allowed folders; `what` is its uri."""

    def __init__(self, place: Place, message: str, hint: str, what: str) -> None:
        super().__init__(place, message, hint)
        self.what = what


class Report:
    """Collects what is wrong in the order in which it is found.

    What changes the geometry is a problem, or merely a note when `lenient`; what is harmless is a note. The same
    sentence is kept once, however often its file is included.
    """

    def __init__(self, *, lenient: bool = False) -> None:
        self.lenient, self.skipped = lenient, 0
        self._problems: dict[Problem, None] = {}
        self._notes: dict[str, None] = {}
        self._missing: dict[str, list[Missing]] = {}

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
        return InvalidInput(self._all())

    def unusable(self, error: Unusable) -> None:
        """Tell something that does."""
        if error.harmless:
            self.note(error.place, f"left out: {error.message}")
        elif self.lenient:
            self.skipped += 1
            self.note(error.place, f"skipped: {error.message}")
        elif isinstance(error, Missing):
            self._missing.setdefault(error.what, []).append(error)
        else:
            self._problems[_problem(error)] = None

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
        return bool(self._problems or self._missing)

    def raise_problems(self) -> None:
        """Raise InvalidInput with everything that was found, if anything was."""
        if self.failed:
            raise InvalidInput(self._all())

    def _all(self) -> list[Problem]:
        return [*self._problems, *(_missing(errors) for errors in self._missing.values())]


def _problem(error: Unusable, more: str = "") -> Problem:
    place = error.place
    message = f"{place.element}: {error.message}{more}" if place.element else f"{error.message}{more}"
    return Problem(place.file, place.line, place.col, CODE, message, hint=error.hint, source=place.source)


def _missing(errors: list[Missing]) -> Problem:
    """A missing asset, told once however often it is asked for."""
    places = dict.fromkeys(error.place for error in errors)
    more = "" if len(places) == 1 else f" (and at {len(places) - 1} more place{'s' if len(places) > 2 else ''})"
    return _problem(errors[0], more)
