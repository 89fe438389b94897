"""Tests of the environment of external stacks, and of errors at their start."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
stack: {external: mine}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""
ENVIRONMENT_WRITER = "#!/bin/sh\nenv > seen.txt\npwd > where.txt\nulimit -v > memory.txt\nexit 7\n"
DRIVING_STACK = """\
import os, sys
sys.path.insert(0, os.environ["SIMSCEN_PEER_PATH"])
import simscen_peer
import helper_of_mine

for step in simscen_peer.Peer("mine"):
    step.drive(helper_of_mine.SPEED, 0.0)
"""


@pytest.fixture
def run(simscen, tmp_path: Path):
    """Return a function that runs a scenario with a command of an external stack."""
    (tmp_path / "good.scenario.yaml").unlink()
    (tmp_path / "mine.scenario.yaml").write_text(SCENARIO)

    def call(command: str, *options: str):
        return simscen("run", "mine.scenario.yaml", "--stack", f"mine={command}", "--out", "out", *options)

    return call


def write_program(folder: Path, text: str, name: str = "nav") -> Path:
    file = folder / name
    file.write_text(text)
    file.chmod(0o755)
    return file


def test_stack_gets_environment_and_folder_of_the_user(run, tmp_path: Path, monkeypatch) -> None:
    write_program(tmp_path, ENVIRONMENT_WRITER)
    variables = {"ROS_DOMAIN_ID": "42", "LD_LIBRARY_PATH": "/opt/x", "PYTHONPATH": "/opt/y", "LINES_": "with\nlines"}
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("PYTHONHASHSEED", raising=False)
    result = run("./nav")
    assert result.code == 3
    assert "its process exited 7" in result.out
    environment = (tmp_path / "seen.txt").read_text()
    assert all(f"{name}={value}\n" in environment for name, value in variables.items())
    assert "PYTHONHASHSEED" not in environment, "simscen sets this variable for its workers only"
    assert "OMP_NUM_THREADS" not in environment or "OMP_NUM_THREADS" in os.environ
    assert (tmp_path / "where.txt").read_text().strip() == str(tmp_path)


def test_stack_has_the_memory_limit_of_the_user(run, tmp_path: Path) -> None:
    write_program(tmp_path, ENVIRONMENT_WRITER)
    run("./nav")
    user_limit = subprocess.run(["sh", "-c", "ulimit -H -v"], capture_output=True, text=True, check=True).stdout
    assert (tmp_path / "memory.txt").read_text() == user_limit


def test_pythonpath_applies_to_the_stack_only(run, tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib/helper_of_mine.py").write_text("SPEED = 0.1\n")
    (tmp_path / "lib/numpy.py").write_text("raise RuntimeError('a numpy of the user')\n")
    (tmp_path / "nav.py").write_text(DRIVING_STACK)
    without = run(f"{sys.executable} nav.py")
    assert without.code == 3
    assert "ModuleNotFoundError: No module named 'helper_of_mine'" in without.out
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "lib"))
    shutil.rmtree(tmp_path / "out")
    result = run(f"{sys.executable} nav.py")
    assert result.code == 0, result.out


def test_output_contains_no_environment_variables(run, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("MY_TOKEN", "s3cr3t-of-the-user")
    (tmp_path / "helper_of_mine.py").write_text("SPEED = 0.1\n")
    (tmp_path / "nav.py").write_text(DRIVING_STACK)
    assert run(f"{sys.executable} nav.py").code == 0
    files = [file for file in (tmp_path / "out").rglob("*") if file.is_file()]
    assert len(files) >= 8
    assert [file for file in files if b"s3cr3t" in file.read_bytes()] == []
    output = json.loads((tmp_path / "out/run.json").read_text())["stacks"]
    assert output["mine"]["command"] == [sys.executable, "nav.py"]
    assert output["mine"]["cwd"] == str(tmp_path)


@pytest.mark.parametrize(
    ("first", "expected_text"),
    [
        ("#!/no/such/python3", "`./nav` starts with `#!/no/such/python3`, which does not exist"),
        ("#!/bin/sh\r", "the first line of `./nav` has a Windows line end; save the file with Unix line ends"),
        ("#! ", "the first line of `./nav` names no interpreter"),
    ],
)
def test_missing_interpreter_is_reported_before_any_run(run, tmp_path, first, expected_text) -> None:
    """The error of the kernel, "no such file or directory", would be for the script, which exists."""
    write_program(tmp_path, f"{first}\nexit 0\n")
    result = run("./nav")
    assert result.code == 2
    assert expected_text in result.err


def test_crash_of_a_stack_is_an_error_with_its_output(run, simscen, tmp_path: Path) -> None:
    """Each error contains the output of its run only."""
    programs = {
        "text": ("hello\n", "cannot be started: Exec format error: neither a program for this machine nor a script"),
        "env": ("#!/usr/bin/env no-such-python\n", "no-such-python"),
        "shell": ("#!/bin/sh\nno-such-command --x\n", "no-such-command: not found"),
        "python": (f"#!{sys.executable}\nimport no_such_module\n", "No module named 'no_such_module'"),
        "silent": ("#!/bin/sh\n", "its process exited 0"),
    }
    for name, (text, _) in programs.items():
        write_program(tmp_path, text, name)
    stacks = [word for name in programs for word in ("--stack", f"{name}=./{name}")]
    result = simscen("run", "mine.scenario.yaml", *stacks, "--stack", "ref=reference", "--out", "out")
    assert result.code == 3
    runs = json.loads((tmp_path / "out/results.json").read_text())["runs"]
    errors = {run["stack_name"]: run["error"] for run in runs}
    assert errors.pop("ref") is None
    for name, (_, output) in programs.items():
        assert errors[name]["kind"] == "stack-crashed"
        assert output in errors[name]["message"] + errors[name]["tail"]
        assert output in result.out
    assert "nothing to compare" in result.out


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc to make a program with a library of its own")
def test_missing_library_is_reported_and_found_in_ld_library_path(run, tmp_path, monkeypatch):
    (tmp_path / "lib").mkdir()
    (tmp_path / "answer.c").write_text("int answer(void) { return 42; }\n")
    (tmp_path / "main.c").write_text("int answer(void); int main(void) { return answer(); }\n")
    library = str(tmp_path / "lib/libanswer.so")
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", library, str(tmp_path / "answer.c")], check=True)
    subprocess.run(["gcc", "-o", str(tmp_path / "nav"), str(tmp_path / "main.c"), library[:-3] + ".so"], check=True)
    (tmp_path / "lib").rename(tmp_path / "elsewhere")
    monkeypatch.delenv("LD_LIBRARY_PATH", raising=False)
    without = run("./nav")
    assert "error while loading shared libraries: " in without.out
    monkeypatch.setenv("LD_LIBRARY_PATH", str(tmp_path / "elsewhere"))
    shutil.rmtree(tmp_path / "out")
    assert "its process exited" in run("./nav").out


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc to make a program with a linker of its own")
def test_missing_dynamic_linker_is_reported(run, tmp_path: Path) -> None:
    (tmp_path / "main.c").write_text("int main(void) { return 0; }\n")
    linker = "-Wl,--dynamic-linker=/no/such/ld.so"
    subprocess.run(["gcc", linker, "-o", str(tmp_path / "nav"), str(tmp_path / "main.c")], check=True)
    result = run("./nav")
    assert result.code == 3
    assert (
        "cannot be started: No such file or directory: the file exists, but something that it needs does not"
        in result.out
    )
