"""Tests of `simscen bench suite` and `bench compare` with a short suite."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{name: wall, points: [[0, 0], [6, 0], [6, 6], [0, 6], [0, 0]]}]}
robot: {pose: {x: 3, y: 3}}
time_limit: 0.1 s
pass: [{collisions: {max: 0}}]
"""


def bench(*arguments: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "simscen.cli.main", "bench", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.mark.slow
def test_a_suite_is_measured_and_its_results_are_compared(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        (tmp_path / f"{name}.scenario.yaml").write_text(SCENARIO)
    done = bench("suite", str(tmp_path), "--most", "2", "-j", "1", "--format", "json")
    assert done.returncode == 0, done.stderr
    expected = json.loads(done.stdout)
    assert (expected["suite"]["runs"], expected["suite"]["workers"], expected["suite"]["unfinished"]) == (2, 1, [])
    assert expected["suite"]["simulated"] < 1.0
    assert len(expected["suite"]["memory"]) == 2
    result = tmp_path / "result.json"
    result.write_text(done.stdout)
    compared = bench("compare", str(result), str(result))
    assert compared.returncode == 0, compared.stderr
    assert "suite: runs a minute" in compared.stdout
    assert "1.00" in compared.stdout


def test_unreadable_comparison_file_is_an_error_before_measuring(tmp_path: Path) -> None:
    (tmp_path / "none.json").write_text("{}")
    done = bench("--compare", str(tmp_path / "none.json"))
    assert (done.returncode, done.stdout) == (2, "")
    assert "none.json is not a result of `simscen bench --format json`" in done.stderr
