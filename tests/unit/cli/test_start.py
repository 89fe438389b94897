"""Tests of the installed command in a separate process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

COMMAND = [sys.executable, "-c", "import sys; from simscen.cli.start import start; sys.exit(start())"]
HEAVY = [
    "numpy.linalg",
    "scipy",
    "pybullet",
    "ompl",
    "filterpy",
    "PIL",
    "mcap",
    "trimesh",
    "embreex",
    "rich",
    "email",
    "simscen.core.records.trace",
]


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("arguments", "code", "expected_text"),
    [
        (("validate", "good.scenario.yaml"), 0, "1 scenario is valid"),
        (("validate", "bad.scenario.yaml"), 2, "unknown key `pose2`"),
        (("validate", "nowhere.scenario.yaml"), 2, "nowhere.scenario.yaml"),
        (("list", "good.scenario.yaml", "--tag", "none"), 5, ""),
        (("report", "nowhere"), 2, "nowhere"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_output_and_exit_code_of_the_command_are_complete(simscen, arguments, code: int, expected_text: str) -> None:
    scenario = Path("good.scenario.yaml").read_text()
    Path("bad.scenario.yaml").write_text(scenario.replace("goals: [{pose:", "goals: [{pose2:"))
    result = subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, check=False)
    assert result.returncode == code, result.stderr
    assert expected_text in result.stdout + result.stderr


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_closed_pipe_prints_no_error(simscen, unbuffered: str) -> None:
    env = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    process = subprocess.Popen(
        [*COMMAND, "list", "."], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env
    )
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    assert process.wait() == 3


def test_simple_world_is_validated_without_numpy_and_engines(simscen) -> None:
    probe = f"import os, sys; os._exit = lambda code: print('imported:', *set(sys.modules) & set({HEAVY}));"
    result = subprocess.run(
        [*COMMAND[:2], probe + COMMAND[2], "validate", "good.scenario.yaml"], capture_output=True, text=True, check=True
    )
    assert result.stdout.splitlines() == ["1 scenario is valid", "imported:"]
