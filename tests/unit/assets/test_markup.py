"""Tests of the XML reader that worlds and robots share."""

import pytest

from simscen.assets import markup
from simscen.core.errors import InvalidInput
from simscen.sim.urdf.xml_source import parse_xml as parse_urdf
from simscen.worlds.sdf.elements import parse as parse_sdf
from simscen.worlds.sdf.report import UnusableElement

BOMB = b'<?xml version="1.0"?>\n<!DOCTYPE a [<!ENTITY b "ha"><!ENTITY c "&b;&b;&b;">]>\n<a>&c;</a>'


@pytest.mark.parametrize(
    ("data", "line", "col", "message"),
    [
        (BOMB, 2, 13, "DOCTYPE not allowed"),
        (b'<!DOCTYPE a SYSTEM "file:///etc/passwd">\n<a/>', 1, 40, "DOCTYPE not allowed"),
        (b"<a>\n  <b></c></a>", 2, 8, "not well-formed XML: mismatched tag"),
        (b"", 1, 1, "not well-formed XML: no element found"),
        (b"<a>" * 101, 1, 301, "nested deeper than 100"),
        (b"<a>\n" + b"<b/>" * 20 + b"</a>", 2, 37, "more than 10 elements"),
        (b"<?xml version='1.0' encoding='klingon'?><a/>", 1, 1, "cannot be read as XML: unknown encoding: klingon"),
    ],
)
def test_worlds_and_robots_have_the_same_xml_errors(
    monkeypatch: pytest.MonkeyPatch, data: bytes, line: int, col: int, message: str
) -> None:
    if "elements" in message:
        monkeypatch.setattr(markup, "MAX_ELEMENTS", 10)
    with pytest.raises(UnusableElement) as world:
        parse_sdf(data, "x.sdf", "")
    with pytest.raises(InvalidInput) as robot:
        parse_urdf(data, "x.urdf")
    location, problem = world.value.location, robot.value.problems[0]
    assert (location.line, location.col, world.value.message) == (line, col, message)
    assert (problem.line, problem.col, problem.message) == (line, col, message)
    assert (location.source, world.value.hint) == (problem.source, problem.hint)


def test_xml_elements_have_position_and_text() -> None:
    root = parse_sdf(b"<a>\n  x<b name='n'/>y\n</a>", "x.sdf", "")
    b = root.children[0]
    assert (b.line, b.col, b.name, b.parent, root.text) == (2, 4, "n", root, "xy")


@pytest.mark.parametrize("comment", [b"<!-- a -- b -->", b"<!---- x ----->", b"<!-- <b> --\n -- \xc3\xa4 -- -->"])
def test_comments_with_double_hyphens_are_accepted_and_positions_kept(comment: bytes) -> None:
    root = parse_sdf(b"<a>" + comment + b"<c/></a>", "x.sdf", "")
    (child,) = root.children
    last = (b"<a>" + comment).split(b"\n")[-1]
    assert (child.line, child.col) == (1 + comment.count(b"\n"), len(last.decode()) + 1)
    assert parse_urdf(b"<a>" + comment + b"<c/></a>", "x.urdf").children[0].tag == "c"


def test_hyphens_outside_comments_stay() -> None:
    root = parse_sdf(b"<a x='--'><![CDATA[<!-- a--b -->]]></a>", "x.sdf", "")
    assert (root.attributes["x"], root.text) == ("--", "<!-- a--b -->")


@pytest.mark.parametrize(
    "before", [b"\n\n", b"<!-- a comment -->\n", b"\xef\xbb\xbf\n<!-- -- -->\n<?xml version='1.0'?>"]
)
def test_xml_declarations_below_the_first_line_are_accepted_and_positions_kept(before: bytes) -> None:
    text = before + b"<?xml version='1.0'\n encoding='utf-8' ?> <a/>"
    for root in (parse_sdf(text, "x.sdf", ""), parse_urdf(text, "x.urdf")):
        assert (root.tag, root.line, root.col) == ("a", 2 + before.count(b"\n"), 22)


def test_an_xml_declaration_at_the_start_defines_the_encoding() -> None:
    text = "<?xml version='1.0' encoding='iso-8859-1'?><a x='ä'/>".encode("iso-8859-1")
    assert parse_sdf(text, "x.sdf", "").attributes["x"] == "ä"


@pytest.mark.parametrize("piece", [b"<!--", b"<?xml "])
def test_unclosed_markup_is_refused_in_linear_time(piece: bytes) -> None:
    with pytest.raises(UnusableElement, match="not well-formed"):
        parse_sdf(b"<a>" + piece * 1_000_000, "x.sdf", "")
