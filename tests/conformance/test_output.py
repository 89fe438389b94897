"""Conformance tests of output folders that are full or not writable."""

import hashlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from simscen.record.log_reader import read_log

SIMSCEN = str(Path(sys.executable).with_name("simscen"))
SCRIPTED_FORK_SERVER = Path(__file__).with_name("scripted_fork_server.py")
SHORT_SILENCE = f"""
import simscen.cli.session.backends
from simscen.cli.main import main
from simscen.run.process import supervisor
simscen.cli.session.fork_server_start.FORK_SERVER = ({str(SCRIPTED_FORK_SERVER)!r},)
supervisor.MAX_SILENCE_S = 5.0
main()
"""
Mounted = Callable[[str, str], "subprocess.CompletedProcess[str]"]


@pytest.fixture
def mounted(folder: Path) -> Mounted:
    """Return a function that runs a script in a folder with a tmpfs at `disk`, mounted with `options`."""
    can_mount = ["unshare", "-rm", "mount", "-t", "tmpfs", "none", "/mnt"]
    if subprocess.run(can_mount, capture_output=True, check=False).returncode:
        pytest.skip("needs permission to mount in a user namespace")
    (folder / "disk").mkdir()

    def call(options: str, script: str) -> "subprocess.CompletedProcess[str]":
        whole = f"mount -t tmpfs -o {options} none disk && {script}"
        return subprocess.run(
            ["unshare", "-rm", "sh", "-c", whole], cwd=folder, capture_output=True, text=True, timeout=120,
            check=False, env={**os.environ, "simscen": SIMSCEN},
        )  # fmt: skip

    return call


def contents(folder: Path) -> dict[str, str]:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_72_read_only_disk_is_an_error_before_any_run(mounted: Mounted) -> None:
    done = mounted("ro", '"$simscen" run . --out disk/out')
    message = "simscen: cannot use the output folder disk/out: Read-only file system\n"
    assert (done.returncode, done.stderr) == (2, message)


@pytest.mark.parametrize("out", ["a.scenario.yaml/out", "/proc/out", "/dev/null/out"])
def test_72_uncreatable_folder_is_an_error_before_any_run(simscen, folder: Path, out: str) -> None:
    ended = simscen("run", "a.scenario.yaml", "--out", out)
    assert ended.code == 2
    assert ended.err.startswith(f"simscen: cannot use the output folder {out}: ")
    assert not list(folder.rglob("*.mcap"))


def test_73_full_disk_is_an_error_of_each_affected_run(mounted: Mounted, folder: Path) -> None:
    text = (folder / "a.scenario.yaml").read_text()
    for name in "bc":
        (folder / f"{name}.scenario.yaml").write_text(text.replace("x: 1.5, y: 1", "x: 5, y: 3"))
    script = '"$simscen" run . --out disk/out -j 1 --format json > all.json; code=$?; cp -r disk/out saved; exit $code'
    done = mounted("size=600k", script)
    assert done.returncode == 3
    runs = {run["scenario"]: run for run in json.loads((folder / "all.json").read_text())["runs"]}
    assert [run["outcome"] for run in runs.values()] == ["passed", "error", "error"]
    for name in "bc":
        assert runs[name]["error"]["kind"] == "output"
        assert re.match("no space left (on device )?writing ", runs[name]["error"]["message"].lower())
        assert "Traceback" not in json.dumps(runs[name])
    (log,) = (folder / "saved").rglob("a/*/run.mcap")
    assert read_log(log).complete


@pytest.mark.slow
def test_74_full_disk_keeps_existing_reports(mounted: Mounted, folder: Path) -> None:
    script = (
        '"$simscen" run . --out disk/out > /dev/null; cp disk/out/junit.xml before.xml; head -c 9m /dev/zero > disk/x;'
        ' "$simscen" report disk/out; code=$?; cp disk/out/junit.xml after.xml; exit $code'
    )
    done = mounted("size=8m", script)
    assert done.returncode == 3
    assert "simscen: cannot write disk/out/junit.xml: No space left on device\n" in done.stderr
    before = (folder / "before.xml").read_bytes()
    assert before
    assert (folder / "after.xml").read_bytes() == before


@pytest.mark.slow
def test_92_full_step_summary_changes_the_exit_code_but_not_the_reports(mounted: Mounted, folder: Path) -> None:
    script = (
        "touch disk/summary; head -c 2m /dev/zero > disk/x; export GITHUB_STEP_SUMMARY=disk/summary;"
        ' "$simscen" run . --format github --out out'
    )
    done = mounted("size=1m", script)
    assert done.returncode == 3
    assert done.stderr.endswith("simscen: cannot write GITHUB_STEP_SUMMARY: No space left on device\n")
    assert json.loads((folder / "out/results.json").read_text())["passed"] == 1


def test_75_nonempty_output_folder_is_refused(simscen, folder: Path) -> None:
    (folder / "out").mkdir()
    (folder / "out/mine.txt").write_text("keep me")
    before = contents(folder / "out")
    ended = simscen("run", "a.scenario.yaml", "--out", "out")
    assert (ended.code, ended.err) == (2, "simscen: the output folder out is not empty; nothing in it was touched\n")
    assert contents(folder / "out") == before


@pytest.mark.parametrize("junit", ["a.scenario.yaml/junit.xml", "/proc/junit.xml", "."])
def test_78_unwritable_report_is_an_error_before_any_run(simscen, folder: Path, junit: str) -> None:
    ended = simscen("run", "a.scenario.yaml", "--junit", junit, "--out", "out")
    assert ended.code == 2
    assert ended.err.startswith(f"simscen: cannot write {junit}: ")
    assert not list(folder.rglob("*.mcap"))


@pytest.mark.slow
def test_102_stopped_fork_server_is_replaced(folder: Path) -> None:
    text = (folder / "a.scenario.yaml").read_text()
    (folder / "a.scenario.yaml").write_text(text.replace("seed: 7", "tags: [stop-preparer]"))
    (folder / "b.scenario.yaml").write_text(text)
    # The run may stop the fork server before it reports the run, so that the wall limit of a run applies as well.
    command = [sys.executable, "-c", SHORT_SILENCE, "run", ".", "--out", "out", "-j", "1", "--wall-limit", "15"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (3, "")
    runs = {run["scenario"]: run for run in json.loads((folder / "out/results.json").read_text())["runs"]}
    assert "did not respond and was killed (SIGKILL)" in runs["a"]["error"]["message"]
    assert runs["b"]["outcome"] == "passed"
