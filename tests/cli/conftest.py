"""The command line in a process of its own, as a user and a CI system call it."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

QUICK = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""
FAILING = QUICK.replace("collisions: {max: 0}", "goals_reached: {}")
LONG = QUICK.replace("time_limit: 1 s", "time_limit: 600 s").replace(
    "goals: [{pose: {x: 5, y: 3}}]", "goals: [" + ", ".join(["{pose: {x: 5, y: 3}}, {pose: {x: 1, y: 1}}"] * 40) + "]"
)

TEXTS = {"quick": QUICK, "failing": FAILING, "long": LONG}

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder to start in."""
    return tmp_path


@pytest.fixture
def scenario(folder: Path) -> Callable[[str, str], None]:
    """Writes NAME.scenario.yaml of a kind: "quick" passes at once, "failing" fails at once, "long" takes minutes."""
    return lambda name, kind: (folder / f"{name}.scenario.yaml").write_text(TEXTS[kind]) and None


@pytest.fixture
def start(folder: Path) -> Start:
    """Starts `simscen ARGUMENTS` in `folder`."""

    def begin(*arguments: str, **options: object) -> "subprocess.Popen[str]":
        settings = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "cwd": folder, **options}
        return subprocess.Popen([sys.executable, "-m", "simscen.cli.main", *arguments], **settings)  # type: ignore[call-overload,no-any-return]

    return begin
