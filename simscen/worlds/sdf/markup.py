"""XML with positions, and nothing of XML that reaches outside the file.

The standard library's ElementTree forgets line numbers, so the tree is built here from expat's events. A document
type declaration is refused, which rules out entity bombs and external entities at once (CWE-776, CWE-611).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from simscen.worlds.sdf.report import Place, Unusable

DEEPEST = 100
MOST_ELEMENTS = 200_000
"""BARN's worlds have 13 000; twenty megabytes of `<a/>` would otherwise take gigabytes."""
LONGEST_SHOWN_LINE, LONGEST_SHOWN_NAME = 300, 120


@dataclass(frozen=True, eq=False)
class Source:
    """A file that was read: its name as shown to users and the folder that its relative paths start from."""

    name: str
    folder: str
    lines: tuple[bytes, ...] = field(repr=False, default=())

    def line(self, number: int) -> str:
        """The text of a line for a caret; empty when it is too long to show."""
        text = self.lines[number - 1] if 0 < number <= len(self.lines) else b""
        return text.decode("utf-8", "replace").rstrip("\r") if len(text) <= LONGEST_SHOWN_LINE else ""


@dataclass(eq=False, slots=True)
class Element:
    """An element with its place in the file; `text` is stripped and joined, `children` keep document order."""

    tag: str
    attributes: dict[str, str]
    source: Source
    line: int
    col: int
    parent: "Element | None" = None
    children: "list[Element]" = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Its own text without the text of its children."""
        return "".join(self.pieces).strip()

    @property
    def name(self) -> str:
        """Its name attribute, or nothing."""
        return self.attributes.get("name", "")

    @property
    def path(self) -> str:
        """Its path from the root, as world[default]/model[shelf]/link[link]."""
        own = f"{_short(self.tag)}[{_short(self.name)}]" if self.name else _short(self.tag)
        return f"{self.parent.path}/{own}" if self.parent and self.parent.parent else own

    @property
    def place(self) -> Place:
        """Where it stands, for messages."""
        return Place(self.source.name, self.line, self.col, self.path, self.source.line(self.line))

    def child(self, tag: str) -> "Element | None":
        """The first child of that kind."""
        return next(self.all(tag), None)

    def all(self, *tags: str) -> "Iterator[Element]":
        """The children of these kinds, in document order."""
        return (child for child in self.children if child.tag in tags)

    def descendants(self) -> "Iterator[Element]":
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


def refuse_doctype(data: bytes, file: str) -> None:
    """Read through an XML file that another library will parse; raises Unusable if it has a DOCTYPE or is broken."""
    _run(expat.ParserCreate(), data, Source(file, ""))


def parse(data: bytes, file: str, folder: str) -> Element:
    """The root element of an XML text; raises Unusable with line and column when it is not well-formed."""
    source = Source(file, folder, tuple(data.split(b"\n")))
    parser = expat.ParserCreate()
    parser.buffer_text = True
    root: list[Element] = []
    open_elements: list[Element] = []
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        parent = open_elements[-1] if open_elements else None
        line, col = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        element = Element(tag, attributes, source, line, col, parent)
        (parent.children if parent else root).append(element)
        open_elements.append(element)
        if len(open_elements) > DEEPEST:
            raise Unusable(Place(file, line, col), f"nested deeper than {DEEPEST}")
        if count > MOST_ELEMENTS:
            raise Unusable(Place(file, line, col), f"more than {MOST_ELEMENTS} elements")

    def end(_: str) -> None:
        open_elements.pop()

    def characters(text: str) -> None:
        open_elements[-1].pieces.append(text)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    _run(parser, data, source)
    return root[0]


def _run(parser: expat.XMLParserType, data: bytes, source: Source) -> None:
    def doctype(*_: object) -> None:
        place = Place(source.name, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        raise Unusable(place, "DOCTYPE not allowed", "remove the document type declaration and its entities")

    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        place = Place(source.name, error.lineno, error.offset + 1, source=source.line(error.lineno))
        raise Unusable(place, f"not well-formed XML: {expat.ErrorString(error.code)}") from error
    except (ValueError, LookupError) as error:  # an encoding that Python's codecs do not know
        raise Unusable(Place(source.name, 1, 1), f"cannot be read as XML: {error}") from error
