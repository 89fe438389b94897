"""Fixtures that call the command line without a new process."""

import signal
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.command_line import exit_code


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


@pytest.fixture(scope="session")
def simscen_in() -> Call:
    """Return a function that runs `simscen ARGUMENTS` in a folder: `simscen_in(folder, *arguments)`."""

    def call(folder: Path, *arguments: object) -> CommandResult:
        with (
            pytest.MonkeyPatch.context() as patch,
            redirect_stdout(StringIO()) as out,
            redirect_stderr(StringIO()) as err,
        ):
            patch.chdir(folder)
            return CommandResult(exit_code(patch, *arguments), out.getvalue(), err.getvalue())

    return call


@pytest.fixture
def simscen(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Call]:
    """Return a function that runs `simscen ARGUMENTS` in a folder with a valid scenario `good.scenario.yaml`."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.scenario.yaml").write_text(GOOD)

    def call(*arguments: object) -> CommandResult:
        code = exit_code(monkeypatch, *arguments)
        out, err = capsys.readouterr()
        return CommandResult(code, out, err)

    yield call
    for number, handler in handlers.items():  # an interrupted command does not restore them
        signal.signal(number, handler)
