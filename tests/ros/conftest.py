"""A real ROS 2, made by `make test-ros`, and runs that a ROS graph drives."""

import itertools
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from mcap.reader import make_reader

ROOT = Path(__file__).parents[2]
ROS = ROOT / ".venv-ros"
NODES = Path(__file__).with_name("nodes")
SIMSCEN = str(Path(sys.executable).with_name("simscen"))
ROOM = """\
simscen: 1
walls:
  - {points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}
obstacles:
  - {name: crate, box: [0.6, 0.6, 0.6], pose: {x: 3, y: 1}}
places: {start: {x: 1, y: 1}, desk: {x: 5, y: 3, yaw: 90 deg}, door: {x: 5, y: 1}}
"""
GOAL = """\
simscen: 1
world: room.world.yaml
robot: {pose: start}
goals: [{pose: desk, timeout: 60 s}]
pass: [{goals_reached: {}}, {collisions: {max: 0}}, {no_false_success: {}}]
"""

SHORT = """\
simscen: 1
world: room.world.yaml
robot: {pose: start}
goals: [{pose: {x: 1.6, y: 2, yaw: 60 deg}, timeout: 30 s}]
pass: [{goals_reached: {}}, {collisions: {max: 0}}]
"""


class Ros(NamedTuple):
    """The Python with rclpy, and the commands that start nodes of these tests with it."""

    python: Path
    interfaces: bool | str

    def node(self, name: str, *arguments: str, sim_time: bool = True, **parameters: object) -> str:
        """Return the command that starts a node."""
        options = [*arguments, *(["-p", "use_sim_time:=true"] if sim_time else [])]
        for key, value in parameters.items():
            options += ["-p", f"{key}:={str(value).lower() if isinstance(value, bool) else value}"]
        return shlex.join([str(self.python), str(NODES / f"{name}.py"), "--ros-args", *options])


@pytest.fixture(scope="session")
def ros() -> Ros:
    """Skip the test if there is no ROS."""
    try:
        made = json.loads((ROS / "rig.json").read_text())
    except OSError:
        pytest.skip("there is no .venv-ros: `make test-ros` makes it where rclpy's wheels can be had")
    return Ros(ROS / "bin" / "python", made["interfaces"])


@pytest.fixture(scope="session")
def with_interfaces(ros: Ros) -> Ros:
    """Skip the test if tf2_msgs and nav2_msgs could not be built."""
    if ros.interfaces is not True:
        pytest.skip(f"tf2_msgs and nav2_msgs could not be built: {ros.interfaces}")
    return ros


class Ended(NamedTuple):
    """How `simscen run` ended: exit code, its output, the folder of the session."""

    code: int
    output: str
    out: Path

    @property
    def logs(self) -> list[Path]:
        """The log of each run."""
        return sorted(self.out.rglob("run.mcap"))

    @property
    def about(self) -> dict[str, Any]:
        """The stack's description in the first log."""
        with self.logs[0].open("rb") as file:
            records = {record.name: record.metadata for record in make_reader(file).iter_metadata()}
        about: dict[str, Any] = json.loads(records["simscen.stack"]["about"])
        return about


Run = Callable[..., Ended]


@pytest.fixture
def run(ros: Ros, tmp_path: Path) -> Run:
    """Return a function that runs a scenario with `simscen ros2 WORDS` as its stack, in a folder with a small world."""
    (tmp_path / "room.world.yaml").write_text(ROOM)
    (tmp_path / "goal.scenario.yaml").write_text(GOAL)
    (tmp_path / "short.scenario.yaml").write_text(SHORT)

    numbers = itertools.count()

    def call(*words: str, scenario: str | Path = "goal.scenario.yaml", options: tuple[str, ...] = ()) -> Ended:
        out = tmp_path / f"out-{next(numbers)}"
        stack = shlex.join([SIMSCEN, "ros2", *words])
        command = [SIMSCEN, "run", str(scenario), "--stack", f"nav={stack}", "--out", str(out), *options]
        environment = {**os.environ, "SIMSCEN_ROS_PYTHON": str(ros.python)}
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300, check=False
        )
        return Ended(done.returncode, re.sub(r"\s+", " ", done.stdout + done.stderr), out)

    return call


@pytest.fixture
def alive() -> Callable[..., list[int]]:
    """Return a function that lists the processes whose command line has `word` and begins with `program`."""

    def find(word: str, program: str = "") -> list[int]:
        found = []
        for process in Path("/proc").iterdir():
            if process.name.isdigit():
                try:
                    words = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                except OSError:
                    continue
                if word in words and words.startswith(program):
                    found.append(int(process.name))
        return sorted(found)

    return find
