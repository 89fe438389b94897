"""XML with the places of its elements, and nothing of XML that reaches outside the file."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from simscen.core.errors import InvalidInput
from simscen.core.problems import Problem

DEEPEST = 100
MOST_ELEMENTS = 100_000
CODE = "SC400"
"""The stable code of every problem with a robot's URDF; the message tells them apart."""


class Unusable(Exception):
    """An element that cannot be used, and why."""

    def __init__(self, element: "Element", message: str, hint: str = "") -> None:
        self.problem = element.problem(message, hint)
        super().__init__(message)


@dataclass(eq=False, slots=True)
class Element:
    """An element and where it stands; `children` in document order."""

    tag: str
    attributes: dict[str, str]
    file: str
    line: int
    col: int
    source: str
    children: "list[Element]" = field(default_factory=list)

    @property
    def name(self) -> str:
        """Its name attribute, or nothing."""
        return self.attributes.get("name", "")

    def child(self, tag: str) -> "Element | None":
        """The first child of that kind."""
        return next(self.all(tag), None)

    def all(self, tag: str) -> "Iterator[Element]":
        """The children of that kind."""
        return (child for child in self.children if child.tag == tag)

    def needed(self, tag: str) -> "Element":
        """The first child of that kind; raises Unusable when there is none."""
        found = self.child(tag)
        if found is None:
            raise Unusable(self, f"<{self.tag}> without <{tag}>")
        return found

    def text(self, attribute: str) -> str:
        """An attribute that must be there."""
        if not self.attributes.get(attribute):
            raise Unusable(self, f'<{self.tag}> without {attribute}="…"')
        return self.attributes[attribute]

    def numbers(self, attribute: str, count: int, default: tuple[float, ...] | None = None) -> tuple[float, ...]:
        """So many finite numbers."""
        if attribute not in self.attributes and default is not None:
            return default
        words = self.text(attribute).split()
        try:
            values = tuple(float(word) for word in words)
        except ValueError:
            raise Unusable(self, f'{attribute}="{" ".join(words)[:60]}" are not numbers') from None
        if len(values) != count:
            raise Unusable(self, f"{attribute} has {len(values)} numbers instead of {count}")
        if not all(math.isfinite(value) and abs(value) <= 1e6 for value in values):
            raise Unusable(self, f"{attribute}: must be a finite number of reasonable size")
        return values

    def positive(self, attribute: str, count: int = 1) -> tuple[float, ...]:
        """So many numbers above zero."""
        values = self.numbers(attribute, count)
        if min(values) <= 0:
            raise Unusable(self, f"{attribute} must be greater than 0")
        return values

    def problem(self, message: str, hint: str = "") -> Problem:
        """What is wrong with it."""
        return Problem(self.file, self.line, self.col, CODE, message, hint, source=self.source)


def parse(data: bytes, file: str) -> Element:
    """The root of an XML text. Raises InvalidInput, with the line, for a DOCTYPE or what is not well-formed.

    A document type declaration is refused because it can name other files and bombs (CWE-611, CWE-776).
    """
    parser = expat.ParserCreate()
    lines = data.split(b"\n")
    roots: list[Element] = []
    opened: list[Element] = []
    count = 0

    def here(number: int) -> str:
        text = lines[number - 1] if 0 < number <= len(lines) else b""
        return text.decode("utf-8", "replace").rstrip("\r") if len(text) <= 300 else ""

    def fail(line: int, col: int, message: str, hint: str = "") -> InvalidInput:
        return InvalidInput([Problem(file, line, col, CODE, message, hint, source=here(line))])

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        line, col = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        if len(opened) >= DEEPEST or count > MOST_ELEMENTS:
            raise fail(line, col, f"nested deeper than {DEEPEST}, or more than {MOST_ELEMENTS} elements")
        element = Element(tag, attributes, file, line, col, here(line))
        (opened[-1].children if opened else roots).append(element)
        opened.append(element)

    def doctype(*_: object) -> None:
        raise fail(parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, "DOCTYPE not allowed", "remove it")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: opened.pop()
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        message = f"not well-formed XML: {expat.ErrorString(error.code)}"
        raise fail(error.lineno, error.offset + 1, message) from error
    except (ValueError, LookupError) as error:  # an encoding that Python's codecs do not know
        raise fail(1, 1, f"cannot be read as XML: {error}") from error
    return roots[0]
