"""Fixtures that call `simscen` as a user does, in a folder with small valid files."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.command_line import exit_code

WORLD = """\
simscen: 1
walls:
  - {points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}
obstacles:
  - {name: crate, box: [1, 1, 1], pose: {x: 3, y: 2}}
places: {start: {x: 1, y: 1}, desk: {x: 5, y: 3}}
"""
ROBOT = """\
simscen: 1
name: cube
body: [{box: [0.3, 0.2, 0.3], z: 4 cm}]
mass: 5 kg
drive: {type: differential, wheel_radius: 5 cm, wheel_separation: 0.25}
limits: {linear: 0.5, angular: 1, linear_acceleration: 1, angular_acceleration: 2}
sensors: {lidar: {lidar: {rate: 10 Hz}}, odom: {odometry: {}}}
"""
SCENARIO = """\
simscen: 1
seed: 7
world: room.world.yaml
robot: {model: cube.robot.yaml, pose: {x: 1, y: 1}}
goals: [{pose: {x: 1.5, y: 1}}]
time_limit: 20
pass: [{goals_reached: {}}]
"""
_PLACE = re.compile(r"^(?P<path>\S.*?)(?P<place>(:\d+:\d+)?): ((error|warning)\[SC\d{3}\]|… and \d+ more)")


class Ended(NamedTuple):
    """Exit code and output of a command."""

    code: int
    out: str
    err: str


Simscen = Callable[..., Ended]
Refused = Callable[..., str]


@pytest.fixture(scope="session")
def texts() -> dict[str, str]:
    """Small valid files by name."""
    return {"room.world.yaml": WORLD, "cube.robot.yaml": ROBOT, "a.scenario.yaml": SCENARIO}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, texts: dict[str, str]) -> Path:
    """Change into a folder with a valid world, robot, and scenario; return the folder."""
    home = tmp_path / "home"
    home.mkdir()
    for name, text in texts.items():
        (home / name).write_text(text)
    monkeypatch.chdir(home)
    return home


@pytest.fixture
def simscen(folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Simscen:
    """Return a function that runs the command line in this process."""

    def call(*arguments: object) -> Ended:
        code = exit_code(monkeypatch, *arguments)
        out, err = capfd.readouterr()
        return Ended(code, out, err)

    return call


@pytest.fixture(scope="session")
def finished_session(tmp_path_factory: pytest.TempPathFactory, texts: dict[str, str]) -> Path:
    """Run the valid scenario once for all tests; return the output folder."""
    home = tmp_path_factory.mktemp("finished") / "home"
    home.mkdir()
    for name, text in texts.items():
        (home / name).write_text(text)
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(StringIO()):
        patch.chdir(home)
        assert exit_code(patch, "run", "a.scenario.yaml", "--out", "out") == 0
    return home / "out"


@pytest.fixture
def log(folder: Path, finished_session: Path) -> Path:
    """Copy the finished session of the valid scenario to the folder; return its log."""
    shutil.copytree(finished_session, folder / "out")
    return folder / "out/runs/a/seed-7/run.mcap"


@pytest.fixture
def refused(simscen: Simscen) -> Refused:
    """Return a function that checks that `validate` and `run` report the same errors, and returns them as text."""

    def call(*arguments: object) -> str:
        validated, ran = simscen("validate", *arguments), simscen("run", *arguments, "--out", "out")
        assert (validated.code, ran.code) == (2, 2), (validated, ran)
        problems = re.sub(r"\d+ problems? in \d+ of \d+ files?\n$", "", validated.out) + validated.err
        assert ran.err == problems
        assert (ran.out, Path("out").exists()) == ("", False)
        assert "Traceback" not in problems
        _check_paths_of_problems(problems)
        return problems

    return call


def _check_paths_of_problems(problems: str) -> None:
    """Check that each problem starts with a path, which exists if the problem has a line and column."""
    heads = [line for line in problems.splitlines() if not line.startswith("    ") and line]
    for head in heads:
        match = _PLACE.match(head)
        assert match, head
        assert not match["place"] or os.path.lexists(match["path"]), head


@pytest.fixture
def with_scenario(folder: Path, refused: Refused) -> Refused:
    """Return a function that writes `bad.scenario.yaml` and calls `refused`; `replace` changes the valid scenario."""

    def call(text: str | bytes | None = None, *arguments: object, replace: dict[str, str] | None = None) -> str:
        if text is None:
            text = SCENARIO
            for old, new in (replace or {}).items():
                assert old in text
                text = text.replace(old, new)
        (folder / "bad.scenario.yaml").write_bytes(text.encode() if isinstance(text, str) else text)
        return refused("bad.scenario.yaml", *arguments)

    return call


@pytest.fixture
def with_world(folder: Path, with_scenario: Refused) -> Refused:
    """Return a function that writes a world file, and calls `refused` for a scenario with it and a robot at (1, 1)."""

    def call(content: str | bytes, name: str = "bad.world.yaml") -> str:
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
        return with_scenario(replace={"room.world.yaml": name})

    return call


MEASURED = """
import sys
from simscen.cli.main import main
try:
    main()
finally:
    (peak,) = [line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")]
    print(peak, file=sys.stderr)
"""


@pytest.fixture
def peak_memory(folder: Path) -> Callable[..., tuple[int, float, str]]:
    """Return a function that runs a command in a new process: exit code, peak memory in MiB, and output."""

    def call(*arguments: object) -> tuple[int, float, str]:
        command = [sys.executable, "-c", MEASURED, *map(str, arguments)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
        *err, peak = done.stderr.splitlines()
        return done.returncode, int(peak) / 1024, done.stdout + "\n".join(err)

    return call


def cases_of(nodeid: str) -> set[int]:
    """Return the numbers of the cases (CASES.md) in a test's name and parameter ids: `test_59_…`, `[59 a daemon]`."""
    name = nodeid.rpartition("::")[2]
    head = re.match(r"test_((?:\d+_(?:and_)?)+)", name)
    parameters = re.findall(r"[\[-](\d+)(?= |\])", name)
    return {int(number) for number in (re.findall(r"\d+", head[1]) if head else []) + parameters}


class Tally:
    """Counts the passed, failed, and skipped cases, and prints them at the end."""

    def __init__(self) -> None:
        self.held: set[int] = set()
        self.broken: set[int] = set()
        self.skipped: dict[int, str] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count a test, in whichever worker it ran."""
        if "conformance/" not in report.nodeid:
            return
        for case in cases_of(report.nodeid):
            if report.skipped:
                self.skipped[case] = str(report.longrepr[2]) if isinstance(report.longrepr, tuple) else "skipped"
            elif report.failed:
                self.broken.add(case)
            elif report.when == "call":
                self.held.add(case)

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the number of cases that passed."""
        held, skipped = self.held - self.broken, sorted(self.skipped.keys() - self.held - self.broken)
        if held or skipped or self.broken:
            why = "; ".join(f"{case}: {self.skipped[case].removeprefix('Skipped: ')}" for case in skipped)
            broken = f", broken: {', '.join(map(str, sorted(self.broken)))}" if self.broken else ""
            line = f"conformance: {len(held)} cases held, {len(skipped)} skipped{why and f' ({why})'}{broken}"
            terminalreporter.write_line(line)


def pytest_configure(config: pytest.Config) -> None:
    """Count the cases, except in the workers of pytest-xdist."""
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Tally())
