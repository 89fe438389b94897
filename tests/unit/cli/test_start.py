"""The installed command, in a process of its own."""

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
    ("arguments", "code", "told"),
    [
        (("validate", "good.scenario.yaml"), 0, "1 scenario is valid"),
        (("validate", "bad.scenario.yaml"), 2, "unknown key `pose2`"),
        (("validate", "nowhere.scenario.yaml"), 2, "nowhere.scenario.yaml"),
        (("list", "good.scenario.yaml", "--tag", "none"), 5, ""),
        (("rum",), 2, "No such command"),
        (("report", "nowhere"), 2, "nowhere"),
        (("--version",), 0, "simscen 0"),
        ((), 2, "Commands:"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_it_prints_everything_and_ends_with_the_code_of_the_command(simscen, arguments, code: int, told: str) -> None:
    good = Path("good.scenario.yaml").read_text()
    Path("bad.scenario.yaml").write_text(good.replace("goals: [{pose:", "goals: [{pose2:"))
    done = subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    assert told in done.stdout + done.stderr


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_is_gone_is_no_error_worth_a_word(simscen, unbuffered: str) -> None:
    env = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    process = subprocess.Popen(
        [*COMMAND, "list", "."], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env
    )
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    assert process.wait() == 3


def test_an_own_world_of_simple_shapes_is_validated_without_numpy_or_any_engine(simscen) -> None:
    probe = f"import os, sys; os._exit = lambda code: print('imported:', *set(sys.modules) & set({HEAVY}));"
    done = subprocess.run(
        [*COMMAND[:2], probe + COMMAND[2], "validate", "good.scenario.yaml"], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == ["1 scenario is valid", "imported:"]
