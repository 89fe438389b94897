"""Fixtures that run a small scenario with a Python program as its stack. Makes `stack_programs.py` importable."""

import os
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from simscen.core.external_command import ExternalCommand
from simscen.core.records.case import Run
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

sys.path.insert(0, str(Path(__file__).parent))
SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
stack: {external: mine}
goals: [{name: desk, pose: {x: 2, y: 1}}]
time_limit: 4
pass: [{goals_reached: {}}]
"""
IMPORTS = """\
import os, sys, time, signal, socket
sys.path.append(os.environ["SIMSCEN_PEER_PATH"])
from simscen_peer import Connection, Peer, messages, wire
"""
Program = Callable[..., ExternalCommand]
Load = Callable[..., LoadedScenario]
Play = Callable[..., Run]


@pytest.fixture
def program(tmp_path: Path) -> Program:
    """Return a function that returns the command for a Python program.

    The program can import only the standard library and the peer module.
    """

    def write(text: str, start_limit: float = 20.0, answer_limit: float = 20.0) -> ExternalCommand:
        file = tmp_path / f"stack-{len(list(tmp_path.iterdir()))}.py"
        file.write_text(IMPORTS + text)
        argv = (sys.executable, "-I", "-S", str(file))
        return ExternalCommand(argv, dict(os.environ), str(tmp_path), start_limit, answer_limit)

    return write


@pytest.fixture
def load(tmp_path: Path, program: Program) -> Load:
    """Return a function that loads SCENARIO with the program as its stack.

    The keyword arguments replace or add top-level keys of the scenario.
    """

    def write(text: str, name: str = "a", start_limit: float = 20.0, answer_limit: float = 20.0, **lines: str):
        keys = {line.split(":")[0]: line for line in SCENARIO.splitlines()}
        keys |= {key: f"{key}: {value}" for key, value in lines.items()}
        file = tmp_path / f"{name}.scenario.yaml"
        file.write_text("\n".join(keys.values()) + "\n")
        loaded = load_scenario(file, tmp_path)
        return replace(loaded, external_command=program(text, start_limit, answer_limit))

    return write


@pytest.fixture
def play(load: Load, tmp_path: Path) -> Play:
    """Return a function that runs the scenario in this process.

    The log is `run.mcap`; `stack.log` contains the output of the program.
    """

    def run(text: str, **lines):
        return simulate(prepare(load(text, **lines)), log=tmp_path / "run.mcap", stack_log=tmp_path / "stack.log")

    return run
