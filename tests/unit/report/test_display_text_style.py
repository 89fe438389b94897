"""Detection of color and live display."""

import io

import pytest

from simscen.report.display_text import TerminalStyle, detect_style


class Stream(io.StringIO):
    def __init__(self, terminal, encoding="utf-8"):
        super().__init__()
        self._terminal, self._encoding = terminal, encoding

    @property
    def encoding(self):
        return self._encoding

    def isatty(self):
        return self._terminal


@pytest.mark.parametrize(
    ("terminal", "environ", "look"),
    [
        (True, {}, TerminalStyle(color=True, live=True, terminal=True)),
        (False, {}, TerminalStyle(color=False, live=False, terminal=False)),
        (True, {"NO_COLOR": "1"}, TerminalStyle(color=False, live=True, terminal=True)),
        (True, {"NO_COLOR": ""}, TerminalStyle(color=True, live=True, terminal=True)),
        (True, {"TERM": "dumb"}, TerminalStyle(color=False, live=False, terminal=True)),
        (True, {"CLICOLOR": "0"}, TerminalStyle(color=False, live=True, terminal=True)),
        (False, {"FORCE_COLOR": "1"}, TerminalStyle(color=True, live=False, terminal=False)),
        (False, {"FORCE_COLOR": "0"}, TerminalStyle(color=False, live=False, terminal=False)),
        (False, {"CLICOLOR_FORCE": "1"}, TerminalStyle(color=True, live=False, terminal=False)),
        (False, {"FORCE_COLOR": "1", "NO_COLOR": "1"}, TerminalStyle(color=False, live=False, terminal=False)),
        (False, {"FORCE_COLOR": "1", "TERM": "dumb"}, TerminalStyle(color=True, live=False, terminal=False)),
    ],
    ids=str,
)
def test_the_environment_decides_before_the_terminal_does(terminal, environ, look):
    assert detect_style(Stream(terminal), environ) == look


def test_a_stream_that_knows_only_ascii_gets_no_escapes():
    assert detect_style(Stream(True, "ascii"), {"FORCE_COLOR": "1"}) == TerminalStyle(
        color=False, live=False, terminal=True
    )


def test_only_a_terminal_has_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "57")
    assert TerminalStyle(color=True, live=False, terminal=False).columns is None
    assert TerminalStyle(color=True, live=True, terminal=True).columns == 57
