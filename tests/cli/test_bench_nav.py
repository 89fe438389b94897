"""Tests of `simscen bench nav` with the shortest experiments."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]


def bench(*options: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "simscen.cli.main", "bench", "nav", "--project", str(PROJECT), *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.slow
def test_experiment_prints_its_numbers_and_resume_repeats_no_run(tmp_path: Path) -> None:
    done = bench("--only", "narrow doorway", "--seeds", "1", "--out", str(tmp_path / "out"), "--format", "json")
    assert done.returncode == 0, done.stderr
    (row,) = json.loads(done.stdout)["experiments"]
    assert (row["tally"]["case"], row["tally"]["runs"]) == ("narrow doorway", 1)
    log = tmp_path / "out/runs/scenarios/corner_cases/narrow_doorway/seed-1/run.mcap"
    written = log.stat().st_mtime_ns
    again = bench("--only", "narrow doorway", "--seeds", "1", "--resume", str(tmp_path / "out"), "--format", "json")
    assert (again.returncode, again.stdout) == (0, done.stdout)
    assert log.stat().st_mtime_ns == written


def test_missing_data_is_reported_as_skipped_and_unknown_experiment_is_an_error(tmp_path: Path) -> None:
    named = ("nothing", "BARN", "sandbox")
    only = [word for name in named for word in ("--only", name)]
    done = bench(*only, "--barn", str(tmp_path / "none"), "--out", str(tmp_path / "out"))
    assert done.returncode == 5
    assert f"BARN: skipped, there is no folder {tmp_path / 'none'}" in done.stderr
    assert "tb3_sandbox: skipped, pass the folder of Nav2's TurtleBot 3 simulation as --nav2; download: " in done.stderr
