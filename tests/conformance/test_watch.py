"""Test of `simscen run --watch` on the command line."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOM = "simscen: 1\nwalls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]\n"
SCENARIO = """\
simscen: 1
world: room.world.yaml
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 0.5 s
pass: [{collisions: {max: 0}}]
"""


class Watch:
    """A `simscen run --watch` process: read its output until a text, and press keys."""

    def __init__(self, folder: Path) -> None:
        command = [sys.executable, "-m", "simscen.cli.main", "run", ".", "-j", "1", "--watch"]
        self.process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )

    def until(self, text: str) -> str:
        assert self.process.stdout is not None
        output = b""
        while text.encode() not in output:
            piece = os.read(self.process.stdout.fileno(), 4096)
            assert piece, f"it ended without {text!r}:\n{output.decode()}"
            output += piece
        return output.decode()

    def press(self, key: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(key.encode())
        self.process.stdin.flush()


@pytest.fixture
def watch(tmp_path: Path) -> Iterator[Watch]:
    (tmp_path / "room.world.yaml").write_text(ROOM)
    (tmp_path / "other.world.yaml").write_text(ROOM)
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    (tmp_path / "b.scenario.yaml").write_text(SCENARIO.replace("room", "other"))
    watch = Watch(tmp_path)
    yield watch
    watch.process.kill()
    watch.process.communicate()


def test_watch_reruns_affected_scenarios_and_reacts_to_keys(watch: Watch, tmp_path: Path) -> None:
    assert "2 passed" in watch.until("q = quit")
    (tmp_path / "other.world.yaml").write_text(ROOM.replace("walls", "wals"))
    assert "unknown key `wals`" in watch.until("q = quit")
    (tmp_path / "other.world.yaml").write_text(ROOM.replace("[6, 0]", "[6.5, 0]"))
    output = watch.until("q = quit")
    assert "1 scenario ·" in output and "✓ b" in output
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO.replace("collisions: {max: 0}", "clearance: {min: 2}"))
    assert "0 passed, 1 failed" in watch.until("f = run those that did not pass (1), q = quit")
    watch.press("f")
    output = watch.until("q = quit")
    assert "0 passed, 1 failed" in output and "1 scenario ·" in output
    watch.press("a")
    assert "1 passed, 1 failed" in watch.until("q = quit")
    watch.press("q")
    assert watch.process.wait(timeout=60) == 1


def begin_long_run(watch: Watch, tmp_path: Path) -> None:
    """Wait for the first session, and begin a session that takes minutes."""
    watch.until("q = quit")
    long_run = SCENARIO.replace("time_limit: 0.5 s", "time_limit: 8000 s\nlinger: 3600 s")
    (tmp_path / "a.scenario.yaml").write_text(long_run)
    watch.until("1 scenario ·")
    deadline = time.monotonic() + 60.0
    while not list(tmp_path.rglob("run.partial.mcap")):
        assert time.monotonic() < deadline, "the run did not start"
        time.sleep(0.05)


def test_sigterm_ends_the_running_session_with_its_reports(watch: Watch, tmp_path: Path) -> None:
    begin_long_run(watch, tmp_path)
    watch.process.send_signal(signal.SIGTERM)
    output, _ = watch.process.communicate(timeout=30)
    assert "interrupted: 0 passed" in output.decode()
    assert watch.process.returncode == 143


def test_running_session_ends_if_watch_mode_is_killed(watch: Watch, tmp_path: Path) -> None:
    begin_long_run(watch, tmp_path)
    watch.process.kill()
    watch.process.communicate(timeout=30)  # returns when the last process that can write the output has ended
