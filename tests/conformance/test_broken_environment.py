"""Conformance tests of broken environments: full disks, closed descriptors, damaged logs."""

import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from simscen.core.clock import Clock
from simscen.record.log_reader import read_log
from simscen.record.recorder import Recorder

SIMSCEN = str(Path(sys.executable).with_name("simscen"))
SIGINT_AT_IMPORT = """
import os, signal, sys
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.argv = ["simscen", *{arguments!r}]
sys.meta_path.insert(0, Interrupting())
from simscen.cli.start import start
start()
"""


def shell(script: str, folder: Path, **environment: str) -> "subprocess.CompletedProcess[str]":
    """Run `script` in a shell; $simscen is the path of the command."""
    environ = {**os.environ, "simscen": SIMSCEN, **environment}
    return subprocess.run(
        ["sh", "-c", script], cwd=folder, capture_output=True, text=True, timeout=60, check=False, env=environ
    )


def outcomes(out: Path) -> list[str]:
    return [run["outcome"] for run in json.loads((out / "results.json").read_text())["runs"]]


@pytest.mark.sample(1)
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", ">&- 2>&- <&-"])
def test_91_closed_file_descriptor_has_no_effect_on_runs(folder: Path, closed: str) -> None:
    done = shell(f'"$simscen" run . --out out {closed}', folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert outcomes(folder / "out") == ["passed"]
    journal = (folder / "out/events.jsonl").read_text().splitlines()
    assert all(json.loads(line) for line in journal), "a report was written to the closed descriptor"


@pytest.mark.parametrize("words", ["validate .", "list .", "--help", "schema"])
def test_91_closed_file_descriptor_has_no_effect_on_printing_commands(folder: Path, words: str) -> None:
    done = shell(f'"$simscen" {words} >&-', folder)
    assert (done.returncode, done.stderr) == (0, "")


def test_92_unusable_step_summary_is_an_error_before_any_run(simscen, folder: Path, monkeypatch) -> None:
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(folder))
    ended = simscen("run", ".", "--format", "github", "--out", "out")
    assert ended.code == 2
    assert ended.err == f"simscen: cannot write GITHUB_STEP_SUMMARY {folder}: Is a directory\n"
    assert not list(folder.rglob("run.mcap"))


def test_92_step_summary_is_ignored_with_other_formats(simscen, folder: Path, monkeypatch) -> None:
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(folder))
    assert simscen("run", ".", "--out", "out").code == 0


@pytest.mark.sample(2)
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("words", ["validate .", "list .", "--help", "schema", "judge out/runs/a/seed-7/run.mcap"])
def test_77_full_stdout_is_an_error_of_printing_commands(folder: Path, words: str) -> None:
    if words.startswith("judge"):
        assert shell('"$simscen" run . --out out', folder).returncode == 0
    done = shell(f'"$simscen" {words} >/dev/full', folder)
    assert (done.returncode, done.stderr) == (3, "simscen: cannot write the output: No space left on device\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_77_full_stderr_keeps_the_exit_code(folder: Path) -> None:
    assert shell('"$simscen" run nowhere --out out 2>/dev/full', folder).returncode == 3


@pytest.mark.parametrize("words", ["run {a}", "validate {a}", "list {a}", "new x", "report out", "doctor"])
def test_93_deleted_working_folder_is_an_error(folder: Path, words: str) -> None:
    (folder / "gone").mkdir()
    command = words.format(a=shlex.quote(str(folder / "a.scenario.yaml")))
    done = shell(f'cd gone && rmdir ../gone && "$simscen" {command}', folder)
    assert (done.returncode, done.stderr) == (2, "simscen: the working directory no longer exists\n")


@pytest.mark.parametrize(
    "module",
    [
        "simscen.core.errors",
        "simscen.cli.main",
        "typer",
        "simscen.cli.commands.run",
        "pydantic",
        "simscen.loading.scenario",
    ],
)
def test_94_ctrl_c_at_startup_prints_no_traceback(folder: Path, module: str) -> None:
    code = SIGINT_AT_IMPORT.format(module=module, arguments=["run", ".", "--out", "out"])
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.parametrize("command", ["judge", "plot"])
def test_95_log_without_ground_truth_is_an_error(simscen, folder: Path, log: Path, command: str) -> None:
    with Recorder(folder / "empty.mcap", Clock(240), read_log(log).header) as recorder:
        recorder.close(0)
    ended = simscen(command, "empty.mcap")
    assert ended.code == 2
    assert ended.err.startswith("empty.mcap: error[SC803] the log has no ground truth")


@pytest.mark.parametrize("command", ["judge", "plot", "log recover"])
@pytest.mark.parametrize("kind", ["fifo", "device", "folder"])
def test_96_log_must_be_a_regular_file(simscen, folder: Path, command: str, kind: str) -> None:
    special_file = folder / "run.mcap"
    if kind == "fifo":
        os.mkfifo(special_file)
    elif kind == "device":
        special_file.symlink_to("/dev/zero")
    else:
        special_file.mkdir()
    ended = simscen(*command.split(), "run.mcap")
    if (command, kind) == ("judge", "folder"):  # which is searched
        assert (ended.code, "no logs found" in ended.err) == (5, True)
        return
    assert ended.code == 2
    assert "error[SC800]" in ended.err


def test_97_command_to_repeat_a_run_is_quoted_for_a_shell(simscen, folder: Path) -> None:
    name = "a;touch marker;$(touch marker) b.scenario.yaml"
    (folder / "a.scenario.yaml").rename(folder / name)
    assert simscen("run", name, "--out", "out").code == 0
    (again,) = [run["again"] for run in json.loads((folder / "out/results.json").read_text())["runs"]]
    assert shlex.split(again) == ["simscen", "run", name, "--seed", "7"]
    (folder / "bin").mkdir()
    (folder / "bin/simscen").write_text("#!/bin/sh\nprintf '%s\\n' simscen \"$@\"\n")
    (folder / "bin/simscen").chmod(0o755)
    done = shell(again, folder, PATH=f"{folder / 'bin'}:{os.environ['PATH']}")
    assert done.stdout.splitlines() == shlex.split(again)
    assert not (folder / "marker").exists()


def test_71_killed_log_can_be_recovered(simscen, folder: Path, log: Path) -> None:
    (folder / "run.partial.mcap").write_bytes(log.read_bytes()[:-20_000])
    assert simscen("log", "recover", "run.partial.mcap").out == "run.partial.mcap: recovered\n"
    assert simscen("log", "recover", "run.partial.mcap").out == "run.partial.mcap: complete, nothing to recover\n"
    shutil.copy(log, folder / "other.mcap")
    assert simscen("log", "recover", "a.scenario.yaml").code == 2
