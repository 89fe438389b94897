"""Tests of the detection of colors and live display."""

import io

import pytest

from simscen.report.display_text import TerminalStyle, detect_style


class Stream(io.StringIO):
    """Text stream that is a terminal or not, with an encoding."""

    def __init__(self, is_terminal, encoding="utf-8"):
        super().__init__()
        self._is_terminal, self._encoding = is_terminal, encoding

    @property
    def encoding(self):
        return self._encoding

    def isatty(self):
        return self._is_terminal


@pytest.mark.parametrize(
    ("is_terminal", "environ", "style"),
    [
        (True, {}, TerminalStyle(has_color=True, has_live_progress=True, is_terminal=True)),
        (False, {}, TerminalStyle(has_color=False, has_live_progress=False, is_terminal=False)),
        (True, {"NO_COLOR": "1"}, TerminalStyle(has_color=False, has_live_progress=True, is_terminal=True)),
        (True, {"NO_COLOR": ""}, TerminalStyle(has_color=True, has_live_progress=True, is_terminal=True)),
        (True, {"TERM": "dumb"}, TerminalStyle(has_color=False, has_live_progress=False, is_terminal=True)),
        (True, {"CLICOLOR": "0"}, TerminalStyle(has_color=False, has_live_progress=True, is_terminal=True)),
        (False, {"FORCE_COLOR": "1"}, TerminalStyle(has_color=True, has_live_progress=False, is_terminal=False)),
        (False, {"FORCE_COLOR": "0"}, TerminalStyle(has_color=False, has_live_progress=False, is_terminal=False)),
        (False, {"CLICOLOR_FORCE": "1"}, TerminalStyle(has_color=True, has_live_progress=False, is_terminal=False)),
        (
            False,
            {"FORCE_COLOR": "1", "NO_COLOR": "1"},
            TerminalStyle(has_color=False, has_live_progress=False, is_terminal=False),
        ),
        (
            False,
            {"FORCE_COLOR": "1", "TERM": "dumb"},
            TerminalStyle(has_color=True, has_live_progress=False, is_terminal=False),
        ),
    ],
    ids=str,
)
def test_environment_variables_override_the_terminal(is_terminal, environ, style):
    assert detect_style(Stream(is_terminal), environ) == style


def test_ascii_stream_gets_no_escape_sequences():
    assert detect_style(Stream(True, "ascii"), {"FORCE_COLOR": "1"}) == TerminalStyle(
        has_color=False, has_live_progress=False, is_terminal=True
    )


def test_only_a_terminal_has_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "57")
    assert TerminalStyle(has_color=True, has_live_progress=False, is_terminal=False).columns is None
    assert TerminalStyle(has_color=True, has_live_progress=True, is_terminal=True).columns == 57
