"""Parse XML into elements with line numbers.

ElementTree of the standard library has no line numbers. A document type declaration is rejected, which prevents entity
bombs and external entities (CWE-776, CWE-611).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeVar
from xml.parsers import expat

from typing_extensions import Self

MAX_DEPTH = 100
MAX_ELEMENTS = 200_000
"""Maximum number of elements, to limit memory."""
MAX_SHOWN_LINE_BYTES = 300
_COMMENT = re.compile(
    rb"<!\[CDATA\[.*?(?:\]\]>|\Z)|(?P<declaration><\?xml\s.*?\?>)|<\?.*?(?:\?>|\Z)|<!--(?P<text>.*?)(?:-->|\Z)",
    re.DOTALL,
)
"""Comment (group `text`) or XML declaration (group `declaration`).

CDATA sections and other processing instructions also match, without these groups, so that their content is skipped.
"""
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


class MalformedXml(Exception):
    """A text is not well-formed XML, or contains XML that is not allowed.

    line, col:  position of the problem, both from 1
    source:     text of the line for messages; "" if unknown or too long
    """

    def __init__(self, message: str, line: int, col: int, source: str = "", hint: str = "") -> None:
        self.message, self.line, self.col, self.source, self.hint = message, line, col, source, hint
        super().__init__(message)


@dataclass(frozen=True, eq=False)
class Source:
    """A file that was read.

    name:    name for messages
    folder:  folder to which relative paths in the file refer
    lines:   lines of the file, to show them in messages
    """

    name: str
    folder: str = ""
    lines: tuple[bytes, ...] = field(repr=False, default=())

    @classmethod
    def of(cls, data: bytes, name: str, folder: str = "") -> "Source":
        """Create an instance from the content of a file."""
        return cls(name, folder, tuple(data.split(b"\n")))

    def line(self, number: int) -> str:
        """Return the text of a line for messages, counted from 1; "" if there is no such line or it is too long."""
        text = self.lines[number - 1] if 0 < number <= len(self.lines) else b""
        return text.decode("utf-8", "replace").rstrip("\r") if len(text) <= MAX_SHOWN_LINE_BYTES else ""


@dataclass(eq=False, slots=True)
class Element:
    """An XML element with its text in parts and its position in the file. Lines and columns count from 1."""

    tag: str
    attributes: dict[str, str]
    source: Source
    line: int
    col: int
    parent: Self | None = None
    children: list[Self] = field(default_factory=list)
    text_parts: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The `name` attribute, or ""."""
        return self.attributes.get("name", "")

    def child(self, tag: str) -> Self | None:
        """Return the first child with this tag, or None."""
        return next(self.all(tag), None)

    def all(self, *tags: str) -> Iterator[Self]:
        """Yield the children with these tags, in document order."""
        return (child for child in self.children if child.tag in tags)


ElementT = TypeVar("ElementT", bound=Element)


def refuse_doctype(data: bytes) -> None:
    """Raise MalformedXml if an XML text has a DOCTYPE or is not well-formed."""
    _run(expat.ParserCreate(), data, Source(""))


def parse(data: bytes, source: Source, kind: type[ElementT]) -> ElementT:
    """Parse an XML text into elements of the class `kind`, and return the root. Raises MalformedXml."""
    parser = expat.ParserCreate()
    parser.buffer_text = True
    root: list[ElementT] = []
    open_elements: list[ElementT] = []
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        parent = open_elements[-1] if open_elements else None
        line, col = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        element = kind(tag, attributes, source, line, col, parent)
        (parent.children if parent else root).append(element)
        open_elements.append(element)
        if len(open_elements) > MAX_DEPTH:
            raise MalformedXml(f"nested deeper than {MAX_DEPTH}", line, col)
        if count > MAX_ELEMENTS:
            raise MalformedXml(f"more than {MAX_ELEMENTS} elements", line, col)

    def end(_: str) -> None:
        open_elements.pop()

    def characters(text: str) -> None:
        open_elements[-1].text_parts.append(text)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    _run(parser, blank_invalid_markup(data), source)
    return root[0]


def blank_invalid_markup(data: bytes) -> bytes:
    """Return the XML text without invalid markup that the parsers of Gazebo and ROS accept.

    Invalid are `--` in comments, and an XML declaration that is not at the start, such as below a comment or an empty
    line. Spaces replace this markup, so that all positions stay the same.
    """
    start = len(_BYTE_ORDER_MARK) if data.startswith(_BYTE_ORDER_MARK) else 0

    def blank(match: re.Match[bytes]) -> bytes:
        if match["declaration"]:
            return match[0] if match.start() == start else re.sub(rb"[^\n]", b" ", match[0])
        text = match["text"]
        if not text or b"-" not in text:
            return match[0]
        begin = match.start("text") - match.start()
        return match[0][:begin] + text.replace(b"-", b" ") + match[0][begin + len(text) :]

    return _COMMENT.sub(blank, data)


def _run(parser: expat.XMLParserType, data: bytes, source: Source) -> None:
    """Parse an XML text with the handlers of a parser. Raises MalformedXml."""

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
