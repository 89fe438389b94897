"""Tests of the tutorial on stack processes: its commands in order, in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs/tutorials/my-stack-process.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
BLOCKS = [(match[1], match[2]) for match in BLOCK.finditer(PAGE)]
NAMES = iter(["room.scenario.yaml", "my_stack.py", ".config/simscen/config.yaml"])
FILES = {next(NAMES): text for kind, text in BLOCKS if kind in ("yaml", "python")}
SESSIONS = [text for kind, text in BLOCKS if kind == "console"]
COMMANDS = [tuple(part.splitlines()) for text in SESSIONS for part in text.split("$ ")[1:]]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("home")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def run_command(command: str, home: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    env = {**os.environ, "HOME": str(home), "XDG_CONFIG_HOME": str(home / "none"), **variables}
    env["PATH"] = f"{Path(sys.executable).parent}:{env['PATH']}"
    return subprocess.run(command, shell=True, cwd=home, env=env, capture_output=True, text=True, check=False)


@pytest.mark.sample(1)
@pytest.mark.parametrize(("command", "shown"), COMMANDS)
def test_command_prints_the_output_of_the_tutorial(home: Path, command: str, shown: str) -> None:
    ended = run_command(command, home)
    assert shown in ended.stdout + ended.stderr
    assert ended.returncode == (0 if "passed" in shown else 2 if "SC060" in shown else 3)


@pytest.mark.slow
def test_configuration_defines_the_command_of_the_stack_name(home: Path) -> None:
    ended = run_command("simscen run room.scenario.yaml", home, XDG_CONFIG_HOME=str(home / ".config"))
    assert (ended.returncode, ended.stderr) == (0, "")


def test_tutorial_has_all_files_and_commands() -> None:
    assert len(FILES) == 3
    assert len(COMMANDS) == 6
