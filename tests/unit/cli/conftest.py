"""Fixture that calls the command line without a new process."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from simscen.cli.main import main


class CommandResult(NamedTuple):
    """Exit code and output of a command."""

    code: int
    out: str
    err: str


Call = Callable[..., CommandResult]

GOOD = """\
simscen: 1
name: drive
tags: [smoke]
world:
  simscen: 1
  walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
  obstacles: [{name: crate, box: [1, 1, 1], pose: {x: 3, y: 2}}]
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
pass: [{goals_reached: {}}]
"""


@pytest.fixture
def simscen(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Call:
    """Return a function that runs `simscen ARGUMENTS` in a folder with a valid scenario `good.scenario.yaml`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.scenario.yaml").write_text(GOOD)

    def call(*arguments: object) -> CommandResult:
        monkeypatch.setattr(sys, "argv", ["simscen", *map(str, arguments)])
        code = 0
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
        out, err = capsys.readouterr()
        return CommandResult(code, out, err)

    return call
