"""Tests of printed problems: carets, escaped text, and encodings."""

import io
import json
import sys

import pytest

from simscen.cli.diagnostics import as_github, as_text, escaped, print_json, print_text
from simscen.core.errors import Problem


def _problem(source: str, col: int, **fields: str) -> Problem:
    return Problem("a.yaml", 7, col, "SC012", "wrong", source=source, **fields)


def _carets(source: str, col: int) -> str:
    """Return the line with carets below the line `source` of a file with a problem at column `col`."""
    return as_text([_problem(source, col)]).splitlines()[2].split("| ")[1]


@pytest.mark.parametrize(
    ("source", "col", "marked"),
    [
        ("raduis: 0.25", 1, "raduis"),
        ("    raduis: 0.25", 5, "raduis"),
        ("time: 90 deg", 7, "90 deg"),
        ("time: 90 deg  # comment", 7, "90 deg"),
        ("{a: b c, d: e}", 5, "b c"),
        ("name: 'it''s, really'", 7, "'it''s, really'"),
        ('name: "a \\" b" # c', 7, '"a \\" b"'),
        ("list: [1, 2]", 7, "["),
        ("- {a: 1}", 1, "-"),
        ("url: a:b#c", 6, "a:b#c"),
    ],
)
def test_caret_marks_the_key_or_value(source: str, col: int, marked: str) -> None:
    assert _carets(source, col) == " " * (col - 1) + "^" * len(marked)


def test_wide_characters_take_two_columns() -> None:
    assert _carets("{机: 1, b: 2}", 9) == "         ^"
    assert _carets("机: x", 1) == "^^"


def test_tab_is_shown_as_a_space() -> None:
    assert _carets("\ta: 1", 2) == " ^"


def test_long_line_is_cut_around_the_position() -> None:
    text = as_text([_problem("x" * 300 + " here " + "y" * 300, 302)])
    line, carets = text.splitlines()[1:3]
    assert len(line) < 120
    assert line[carets.index("^") :].startswith("here")


def test_position_beyond_the_line_gets_a_caret() -> None:
    assert _carets("a:", 3) == "  ^"


def test_problem_without_a_line_is_one_line() -> None:
    assert as_text([Problem("a.yaml", 0, 0, "SC001", "no such file")]) == "a.yaml: error[SC001] no such file"


@pytest.mark.parametrize(
    "text", ["::error::x", "  ::set-output name=a::b", "##[error]x", "a\n::error::b", "\x1b[31m", "\u202e"]
)
def test_control_sequences_in_untrusted_text_are_escaped(text: str) -> None:
    output = escaped(text)
    assert not output.lstrip().startswith("::")
    assert "##[" not in output
    assert "\n" not in output
    assert output.isprintable()


def test_annotations_escape_github_syntax() -> None:
    problem = Problem("a,b:c%.yaml", 1, 2, "SC012", "50 %\r\n::error::x", "a:b")
    assert as_github([problem]) == (
        "::error file=a%2Cb%3Ac%25.yaml,line=1,col=2,title=simscen SC012::50 %25%0D%0A::error::x%0Aa:b"
    )


def test_ascii_stream_gets_ascii() -> None:
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding="ascii")
    print_text("a → b … 机", stream)
    stream.flush()
    assert raw.getvalue().isascii()


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_json_on_stdout_is_valid_in_every_encoding(monkeypatch: pytest.MonkeyPatch, encoding: str) -> None:
    stream = io.TextIOWrapper(io.BytesIO(), encoding)
    monkeypatch.setattr(sys, "stdout", stream)
    data = {"limit": "≤ 1 °C", "name": "täst 😀", "file": "\udcff", "marker": "##[error]"}
    print_json(json.dumps(data, ensure_ascii=False))
    stream.flush()
    written = stream.buffer.getvalue().decode(encoding)
    assert json.loads(written) == data
    assert "##[" not in written
