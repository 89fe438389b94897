"""The elements of an SDF file, which say what is wrong with them at their path."""

from collections.abc import Iterator
from dataclasses import dataclass

from typing_extensions import Self

from simscen.assets import markup
from simscen.worlds.sdf.report import Place, Unusable

LONGEST_SHOWN_NAME = 120


@dataclass(eq=False, slots=True)
class Element(markup.Element):
    """An element of an SDF file or of what it includes."""

    @property
    def text(self) -> str:
        """Its own text without the text of its children."""
        return "".join(self.pieces).strip()

    @property
    def path(self) -> str:
        """Its path from the root, as world[default]/model[shelf]/link[link]."""
        own = f"{_short(self.tag)}[{_short(self.name)}]" if self.name else _short(self.tag)
        return f"{self.parent.path}/{own}" if self.parent and self.parent.parent else own

    @property
    def place(self) -> Place:
        """Where it stands, for messages."""
        return Place(self.source.name, self.line, self.col, self.path, self.source.line(self.line))

    def descendants(self) -> Iterator[Self]:
        """Everything below it, in document order."""
        for child in self.children:
            yield child
            yield from child.descendants()

    def unusable(self, message: str, hint: str = "") -> Unusable:
        """The error that says so about this element."""
        return Unusable(self.place, message, hint)


def _short(name: str) -> str:
    """A name that is safe to print, whatever somebody put into it."""
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in name)
    return shown if len(shown) <= LONGEST_SHOWN_NAME else f"{shown[:LONGEST_SHOWN_NAME]}…"


def parse(data: bytes, file: str, folder: str) -> Element:
    """The root element of an XML text; raises Unusable with line and column when it is not well-formed."""
    try:
        return markup.parse(data, markup.Source.of(data, file, folder), Element)
    except markup.Broken as error:
        place = Place(file, error.line, error.col, source=error.source)
        raise Unusable(place, error.message, error.hint) from error
