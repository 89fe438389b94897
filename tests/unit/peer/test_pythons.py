"""Tests that the peer runs with Python 3.8 and later, and needs only the standard library."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from simscen import peer

FOLDER = Path(peer.__file__).parent
FILES = sorted(FOLDER.rglob("*.py"))
VERSIONS = ["3.8", "3.9", "3.10", "3.11", "3.12", "3.13"]
PROGRAM = """\
import os, socket, sys, threading
sys.path.append(os.environ["SIMSCEN_PEER_PATH"])
from simscen_peer import Connection, Peer, messages, wire

ours, theirs = socket.socketpair()
engine = Connection(ours)
says = [{"topic": "/odom", "type": "std_msgs/msg/Bool", "number": 1}]
names = ["/cmd_vel", "/simscen/events", "/rosout"]
hears = [{"topic": name, "type": "", "number": number} for number, name in enumerate(names, 1)]
goal = {"name": "a", "x": 1.0, "y": 2.0, "yaw": 0.0, "xy_tolerance": 0.1, "yaw_tolerance": 0.2, "timeout": None}
engine.send_json(wire.HELLO, {"protocols": [1], "robot": {}, "says": says, "hears": hears})
engine.send_json(wire.GOAL, {"goals": [goal, dict(goal, name="b")]})
engine.send(wire.step_frame(wire.StepHeader(12, 0, 50000000, 1000, 1), [(1, bytes([0, 1, 0, 0, 1]))]))
engine.send_json(wire.PREEMPT, {"tick": 24, "goal": dict(goal, name="c")})
engine.send_json(wire.CANCEL, {"tick": 24, "all": True, "reason": "canceled"})
engine.send(wire.step_frame(wire.StepHeader(24, 0, 100000000, 1000, 1), []))
engine.send_json(wire.END, {"reason": "time limit"})
peer = Peer("p", "1", topics=None, connection=Connection(theirs))
seen = []
for step in peer:
    accepted = peer.goals.accept()
    seen.append((step.tick, step.stamp, step.get("/odom"), accepted and accepted.name, step.canceled))
    step.log("hello")
    step.drive(0.5, 0.25)
peer.add(more=1)
print(seen)
kinds = []
while True:
    kind, body = engine.receive()
    kinds.append(wire.KIND_NAMES[kind])
    if kind == wire.ANSWER:
        tick, messages = wire.from_answer(body)
        kinds.append([number for number, _ in messages])
    if kind == wire.BYE:
        break
print(kinds)
engine.close()
"""
EXPECTED_OUTPUT = """\
[(12, (0, 50000000), True, 'a', False), (24, (0, 100000000), None, None, True)]
['WELCOME', 'ANSWER', [3, 1, 2], 'ANSWER', [3, 1, 2], 'BYE']
"""


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_every_file_is_python_3_8(file: Path) -> None:
    tree = ast.parse(file.read_text(encoding="utf-8"), feature_version=(3, 8))
    if any(isinstance(node, ast.Import | ast.ImportFrom) and getattr(node, "level", 0) for node in ast.walk(tree)):
        assert "from __future__ import annotations" in file.read_text() or file.name == "__init__.py"


def test_peer_imports_only_the_standard_library() -> None:
    imported = set()
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                imported.add((node.module or "").partition(".")[0])
    assert imported <= sys.stdlib_module_names


def pythons(version: str) -> list[str]:
    """Return the paths of the interpreters of this version on this machine."""
    folders = [Path.home() / ".pyenv/versions", Path.home() / ".local/share/uv/python"]
    found = [str(path) for folder in folders for path in folder.glob(f"*{version}.*/bin/python3")]
    return [*filter(None, [shutil.which(f"python{version}")]), *found]


@pytest.mark.sample(2)
@pytest.mark.parametrize("version", VERSIONS)
def test_peer_client_works_on_this_python(version: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(PROGRAM)
    env = {"SIMSCEN_PEER_PATH": str(FOLDER / "standalone"), "HOME": os.environ.get("HOME", "/")}
    for python in pythons(version):
        command = [python, "-I", "-S", "-W", "error", str(tmp_path / "a.py")]
        completed = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
        if "No module named" not in completed.stderr and "command not found" not in completed.stderr:
            assert (completed.stdout, completed.stderr) == (EXPECTED_OUTPUT, "")
            return
    pytest.skip(f"there is no Python {version} on this machine")
