"""A real Nav2, made by `make test-nav2`, and runs that it drives."""

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
import yaml
from mcap.reader import make_reader

ROOT = Path(__file__).parents[2]
BRINGUP, COMPOSE = Path(__file__).with_name("bringup.sh"), Path(__file__).with_name("compose.sh")
SIMSCEN = str(Path(sys.executable).with_name("simscen"))
CONTROLLER = {
    "plugin": "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
    "desired_linear_vel": 0.4,
    "lookahead_dist": 0.6,
    "transform_tolerance": 0.5,
}


class Nav2(NamedTuple):
    """An environment in which Nav2 runs, and nav2_bringup's parameters, with changes for these tests and without."""

    environment: dict[str, str]
    script: Path
    python: Path
    params: Path
    unchanged_params: Path

    def with_parameters(self, file: Path, change: Callable[[dict[str, Any]], object]) -> "Nav2":
        """Return Nav2 with parameters that `change` has changed, in a new file."""
        nodes = yaml.safe_load(self.params.read_text())
        change(nodes)
        file.write_text(yaml.safe_dump(nodes))
        return self._replace(params=file)

    @property
    def launch(self) -> str:
        """The command that starts all servers."""
        return shlex.join(["bash", str(BRINGUP), str(self.script), str(self.params)])

    @property
    def composed_launch(self) -> str:
        """The command that starts all servers in one process."""
        return shlex.join(["bash", str(COMPOSE), str(self.script), str(self.params), str(self.python)])


@pytest.fixture(scope="session")
def nav2(tmp_path_factory: pytest.TempPathFactory) -> Nav2:
    """Skip the test if there is no Nav2."""
    folder = Path(os.environ.get("SIMSCEN_NAV2", ROOT / ".nav2"))
    try:
        made = json.loads((folder / "rig.json").read_text())
    except OSError:
        pytest.skip(f"there is no Nav2 in {folder}: `make test-nav2` makes it where it can")
    command = ["bash", "-c", f"source {shlex.quote(made['env'])} && env -0"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    environment = dict(line.partition("=")[::2] for line in printed.split("\0") if line)
    params = tmp_path_factory.mktemp("nav2") / "nav2_params.yaml"
    params.write_text(yaml.safe_dump(parameters(Path(made["params"]))))
    return Nav2(environment, Path(made["env"]), Path(made["python"]), params, Path(made["params"]))


def parameters(file: Path) -> dict[str, Any]:
    """Return nav2_bringup's parameters with simulated time, a longer server timeout, and regulated pure pursuit."""
    nodes: dict[str, Any] = yaml.safe_load(file.read_text())
    for name, node in nodes.items():
        own = node if "ros__parameters" in node else node[name]  # costmaps are nested twice
        own["ros__parameters"]["use_sim_time"] = True
    nodes["controller_server"]["ros__parameters"]["FollowPath"] = CONTROLLER
    # Wall time in ms that the behavior tree waits for a server; the default of 20 is too short for a busy machine.
    nodes["bt_navigator"]["ros__parameters"]["default_server_timeout"] = 200
    return nodes


class Ended(NamedTuple):
    """How `simscen run` ended: exit code, its output, the folder of the session."""

    code: int
    output: str
    out: Path

    @property
    def about(self) -> dict[str, Any]:
        """The stack's description in the log."""
        return self._stack("about")

    def about_of(self, robot: str) -> dict[str, Any]:
        """Return the description of the stack of one of several robots."""
        return self._stack(f"{robot}.about")

    def _stack(self, key: str) -> dict[str, Any]:
        with next(self.out.rglob("run.mcap")).open("rb") as file:
            records = {record.name: record.metadata for record in make_reader(file).iter_metadata()}
        about: dict[str, Any] = json.loads(records["simscen.stack"][key])
        return about

    @property
    def stack_log(self) -> str:
        """What Nav2 and the adapter printed."""
        return next(self.out.rglob("stack.log")).read_text()


@pytest.fixture
def run(nav2: Nav2, tmp_path: Path) -> Callable[..., Ended]:
    """Return a function that runs a scenario of the library with `simscen ros2 nav2 WORDS` as its stack."""

    def call(scenario: str | Path, *words: str, launch: str = nav2.launch) -> Ended:
        out = tmp_path / "out"
        adapter = [SIMSCEN, "ros2", "nav2", "--base-frame", "base_footprint", "--ready", "60", "--launch", launch]
        stack = shlex.join([*adapter, *words])
        command = [SIMSCEN, "run", str(ROOT / "scenarios" / scenario), "--stack", f"nav2={stack}", "--out", str(out)]
        environment = {**nav2.environment, "SIMSCEN_ROS_PYTHON": str(nav2.python)}
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=400, check=False
        )
        return Ended(done.returncode, re.sub(r"\s+", " ", done.stdout + done.stderr), out)

    return call
