"""Tests of the tutorial on ROS 2 stacks, with the files of the page."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/tutorials/my-ros2-stack.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"^```(?:python|yaml)\n# (\S+)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
COMMANDS = re.findall(r"^\$ (simscen .*)$", PAGE, re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [COMMANDS[0], pytest.param(COMMANDS[1], marks=pytest.mark.slow)],
    ids=["once", "twice"],
)
def test_a_command_of_the_tutorial_works(ros, tmp_path: Path, command: str) -> None:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    # simscen's virtual environment comes first, then the user's ROS.
    folders = [str(Path(sys.executable).parent), str(ros.python.parent), os.environ["PATH"]]
    environment = {**os.environ, "PATH": os.pathsep.join(folders)}
    done = subprocess.run(
        command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=200, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 passed" in done.stdout or "2 passed" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ('"cmd_vel"', '"speed"'),
            "no node publishes /cmd_vel (geometry_msgs/msg/Twist or geometry_msgs/msg/TwistStamped)",
        ),
        pytest.param(
            ('"scan"', '"front"'),
            "no node subscribes to /scan; /drive waits for /front (sensor_msgs/msg/LaserScan), which",
            marks=pytest.mark.slow,
        ),
    ],
    ids=["no commands", "another name"],
)
def test_the_errors_in_the_tutorial_are_real(ros, run, tmp_path: Path, change, message: str) -> None:
    (tmp_path / "drive.py").write_text(FILES["drive.py"].replace(*change))
    ended = run("--ready", "5", "--launch", f"{ros.python} drive.py --ros-args -p use_sim_time:=true")
    assert message in ended.output
    assert message in PAGE
