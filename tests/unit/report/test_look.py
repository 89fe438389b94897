"""Who gets colors and a live display."""

import io

import pytest

from simscen.report.look import Look, look_of


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
        (True, {}, Look(color=True, live=True, terminal=True)),
        (False, {}, Look(color=False, live=False, terminal=False)),
        (True, {"NO_COLOR": "1"}, Look(color=False, live=True, terminal=True)),
        (True, {"NO_COLOR": ""}, Look(color=True, live=True, terminal=True)),
        (True, {"TERM": "dumb"}, Look(color=False, live=False, terminal=True)),
        (True, {"CLICOLOR": "0"}, Look(color=False, live=True, terminal=True)),
        (False, {"FORCE_COLOR": "1"}, Look(color=True, live=False, terminal=False)),
        (False, {"FORCE_COLOR": "0"}, Look(color=False, live=False, terminal=False)),
        (False, {"CLICOLOR_FORCE": "1"}, Look(color=True, live=False, terminal=False)),
        (False, {"FORCE_COLOR": "1", "NO_COLOR": "1"}, Look(color=False, live=False, terminal=False)),
        (False, {"FORCE_COLOR": "1", "TERM": "dumb"}, Look(color=True, live=False, terminal=False)),
    ],
    ids=str,
)
def test_the_environment_decides_before_the_terminal_does(terminal, environ, look):
    assert look_of(Stream(terminal), environ) == look


def test_a_stream_that_knows_only_ascii_gets_no_escapes():
    assert look_of(Stream(True, "ascii"), {"FORCE_COLOR": "1"}) == Look(color=False, live=False, terminal=True)


def test_only_a_terminal_has_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "57")
    assert Look(color=True, live=False, terminal=False).columns is None
    assert Look(color=True, live=True, terminal=True).columns == 57
