"""The scenarios that ship, run through the front door: all pass, and repeat byte for byte whatever runs beside them."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def simscen(*arguments, cwd=ROOT):
    command = [sys.executable, "-m", "simscen.cli.main", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=600, check=False)


def hashes(folder: Path) -> dict[str, str]:
    logs = sorted(folder.rglob("run.mcap"))
    return {log.parent.relative_to(folder).as_posix(): hashlib.sha256(log.read_bytes()).hexdigest() for log in logs}


@pytest.fixture(scope="module")
def together(tmp_path_factory):
    """All of them once, two at a time."""
    folder = tmp_path_factory.mktemp("shipped") / "out"
    done = simscen("run", "scenarios/", "-j", 2, "--out", folder)
    return folder, done


def test_all_shipped_scenarios_pass(together):
    folder, done = together
    assert done.returncode == 0, done.stdout + done.stderr
    results = json.loads((folder / "results.json").read_text())
    assert results["passed"] == results["total"] >= 12


def test_every_run_leaves_its_log_its_result_its_picture_and_its_scenario(together):
    folder, _ = together
    for log in folder.rglob("run.mcap"):
        left = {file.name for file in log.parent.iterdir()}
        assert left >= {"run.mcap", "result.json", "map.png", "scenario.yaml", "worker.log"}


def test_one_at_a_time_in_another_folder_gives_the_same_bytes(together, tmp_path):
    folder, _ = together
    done = simscen("run", ROOT / "scenarios" / "obstacles", "-j", 1, "--out", tmp_path / "out", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    alone = hashes(tmp_path / "out")
    assert alone
    assert alone == {run: sha for run, sha in hashes(folder).items() if run in alone}


def test_results_are_equal_whatever_ran_beside(together, tmp_path):
    folder, _ = together
    simscen("run", "scenarios/faults/wheel_slip.scenario.yaml", "--out", tmp_path / "out")
    (alone,) = (tmp_path / "out").rglob("result.json")
    assert alone.read_bytes() == (folder / alone.relative_to(tmp_path / "out")).read_bytes()


def test_another_seed_gives_another_log(together, tmp_path):
    folder, _ = together
    simscen("run", "scenarios/navigation/goal.scenario.yaml", "--seed", 2, "--out", tmp_path / "out")
    (other,) = hashes(tmp_path / "out").values()
    assert other not in hashes(folder).values()


def test_check_determinism_compares_the_logs_of_two_runs(tmp_path):
    out = tmp_path / "out"
    done = simscen("run", "scenarios/navigation/goal.scenario.yaml", "--check-determinism", "--out", out)
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(list(out.rglob("run.mcap"))) == 2
