"""XML with positions, and nothing of XML that reaches outside the file.

The standard library's ElementTree forgets line numbers, so the tree is built here from expat's events. A document
type declaration is refused, which rules out entity bombs and external entities at once (CWE-776, CWE-611).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeVar
from xml.parsers import expat

from typing_extensions import Self

DEEPEST = 100
MOST_ELEMENTS = 200_000
"""BARN's worlds have 13 000; twenty megabytes of `<a/>` would otherwise take gigabytes."""
LONGEST_SHOWN_LINE = 300
_COMMENT = re.compile(rb"<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?(?:\?>|\Z)|<!--(?P<text>.*?)(?:-->|\Z)", re.DOTALL)
"""A comment; CDATA sections and processing instructions match too, so that no comment is found inside them."""


class MalformedXml(Exception):
    """Why a text is not XML that is read, at which line and column of it, both from 1."""

    def __init__(self, message: str, line: int, col: int, source: str = "", hint: str = "") -> None:
        self.message, self.line, self.col, self.source, self.hint = message, line, col, source, hint
        super().__init__(message)


@dataclass(frozen=True, eq=False)
class Source:
    """A file that was read: its name as shown to users and the folder that its relative paths start from."""

    name: str
    folder: str = ""
    lines: tuple[bytes, ...] = field(repr=False, default=())

    @classmethod
    def of(cls, data: bytes, name: str, folder: str = "") -> "Source":
        """With its lines, which messages show."""
        return cls(name, folder, tuple(data.split(b"\n")))

    def line(self, number: int) -> str:
        """Return the text of a line for a message with a caret; empty if it is too long."""
        text = self.lines[number - 1] if 0 < number <= len(self.lines) else b""
        return text.decode("utf-8", "replace").rstrip("\r") if len(text) <= LONGEST_SHOWN_LINE else ""


@dataclass(eq=False, slots=True)
class Element:
    """An element with its place in the file; `children` keep document order, `pieces` are of its own text."""

    tag: str
    attributes: dict[str, str]
    source: Source
    line: int
    col: int
    parent: Self | None = None
    children: list[Self] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Its name attribute, or nothing."""
        return self.attributes.get("name", "")

    def child(self, tag: str) -> Self | None:
        """Return the first child with this tag, or None."""
        return next(self.all(tag), None)

    def all(self, *tags: str) -> Iterator[Self]:
        """Yield the children with these tags, in document order."""
        return (child for child in self.children if child.tag in tags)


E = TypeVar("E", bound=Element)


def refuse_doctype(data: bytes) -> None:
    """Read through XML that another library will parse; raises Broken if it has a DOCTYPE or is not well-formed."""
    _run(expat.ParserCreate(), data, Source(""))


def parse(data: bytes, source: Source, kind: type[E]) -> E:
    """Parse an XML text into elements of a class, and return the root; raises Broken."""
    parser = expat.ParserCreate()
    parser.buffer_text = True
    root: list[E] = []
    open_elements: list[E] = []
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        parent = open_elements[-1] if open_elements else None
        line, col = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        element = kind(tag, attributes, source, line, col, parent)
        (parent.children if parent else root).append(element)
        open_elements.append(element)
        if len(open_elements) > DEEPEST:
            raise MalformedXml(f"nested deeper than {DEEPEST}", line, col)
        if count > MOST_ELEMENTS:
            raise MalformedXml(f"more than {MOST_ELEMENTS} elements", line, col)

    def end(_: str) -> None:
        open_elements.pop()

    def characters(text: str) -> None:
        open_elements[-1].pieces.append(text)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    _run(parser, blank_hyphens_in_comments(data), source)
    return root[0]


def blank_hyphens_in_comments(data: bytes) -> bytes:
    """Return the text with spaces for the hyphens inside comments; all positions stay the same.

    XML forbids `--` in comments and expat refuses it, but the parsers of Gazebo and ROS (tinyxml2) accept it, so many
    published files contain it.
    """

    def blank(match: re.Match[bytes]) -> bytes:
        text = match["text"]
        if not text or b"-" not in text:
            return match[0]
        start = match.start("text") - match.start()
        return match[0][:start] + text.replace(b"-", b" ") + match[0][start + len(text) :]

    return _COMMENT.sub(blank, data)


def _run(parser: expat.XMLParserType, data: bytes, source: Source) -> None:
    def doctype(*_: object) -> None:
        line, col = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        hint = "remove the document type declaration and its entities"
        raise MalformedXml("DOCTYPE not allowed", line, col, source.line(line), hint)

    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        message = f"not well-formed XML: {expat.ErrorString(error.code)}"
        raise MalformedXml(message, error.lineno, error.offset + 1, source.line(error.lineno)) from error
    except (ValueError, LookupError) as error:  # an encoding that Python's codecs do not know
        raise MalformedXml(f"cannot be read as XML: {error}", 1, 1) from error
