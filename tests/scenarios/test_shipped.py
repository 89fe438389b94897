"""Tests of the shipped scenarios on the command line: they pass and are reproducible."""

import hashlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from simscen.judge import several_robots
from simscen.judge.result_json import read_result, to_json
from simscen.judge.run_result import judge_run
from simscen.loading.scenario_text import criteria_of_text
from simscen.record.log_reader import read_log
from simscen.record.trace_difference import first_difference

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "scenarios").rglob("*.scenario.yaml"))
QUICK_STEP = 8
"""`make test` runs every eighth shipped scenario."""


def simscen(*arguments, cwd=ROOT):
    """Run the command; return the finished process."""
    command = [sys.executable, "-m", "simscen.cli.main", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=600, check=False)


def hashes(folder: Path, name: str) -> dict[str, str]:
    """Return the hash of each file of this name, by the path of its folder."""
    logs = sorted(folder.rglob(name))
    return {log.parent.relative_to(folder).as_posix(): hashlib.sha256(log.read_bytes()).hexdigest() for log in logs}


@pytest.fixture(scope="module")
def shipped_session(request, tmp_path_factory):
    """Return the folder and the finished process of a session of the shipped scenarios, or every eighth of them."""
    every = QUICK_STEP if request.config.option.markexpr == "not slow" else 1
    folder = tmp_path_factory.mktemp("shipped") / "out"
    return folder, simscen("run", *SHIPPED[::every], "-j", 2, "--out", folder)


def test_shipped_scenarios_pass(shipped_session):
    folder, process = shipped_session
    assert process.returncode == 0, process.stdout + process.stderr
    results = json.loads((folder / "results.json").read_text())
    assert results["passed"] == results["total"] >= len(SHIPPED) // QUICK_STEP


def test_every_run_writes_log_result_picture_and_scenario(shipped_session):
    folder, _ = shipped_session
    logs = list(folder.rglob("run.mcap"))
    assert len(logs) >= len(SHIPPED) // QUICK_STEP
    for log in logs:
        written = {file.name for file in log.parent.iterdir()}
        assert written >= {"run.mcap", "result.json", "map.png", "scenario.yaml", "worker.log"}


@pytest.mark.slow
def test_logs_and_results_are_equal_in_serial_and_from_another_folder(shipped_session, tmp_path):
    folder, _ = shipped_session
    process = simscen("run", *SHIPPED, "-j", 1, "--out", tmp_path / "out", cwd=tmp_path)
    assert process.returncode == 0, process.stdout + process.stderr
    for name in ("run.mcap", "result.json"):
        logs = hashes(tmp_path / "out", name)
        assert len(logs) >= len(SHIPPED)
        assert logs.items() <= hashes(folder, name).items()


@pytest.mark.parametrize("every", [4, pytest.param(1, marks=pytest.mark.slow)], ids=["every fourth", "all"])
def test_run_replay_and_judge_give_the_same_verdicts(shipped_session, every: int):
    folder, _ = shipped_session
    logs = sorted(folder.rglob("run.mcap"))[::every]
    assert logs
    for file in logs:
        live, log = read_result(file.with_name("result.json")), read_log(file)
        judged = judge_log(live, log, file.name)
        assert to_json(judged) == file.with_name("result.json").read_text(encoding="utf-8") == log.result, file


def judge_log(live, log, name):
    """Judge the log; return the result, which combines the results of all robots."""
    if not log.robots:
        criteria = criteria_of_text(log.header.scenario, name, {}).pass_
        return judge_run(live.key, live.path, criteria, log.trace, log.header.case, live.lines)
    results, lines = {}, list(live.lines)
    for robot, robot_log in log.robots.items():
        criteria = criteria_of_text(log.header.scenario, name, log.header.facts, robot).pass_
        robot_lines, lines = tuple(lines[: len(criteria)]), lines[len(criteria) :]
        results[robot] = judge_run(live.key, live.path, criteria, robot_log.trace, robot_log.header.case, robot_lines)
    return several_robots.combine_robots(results, {robot: robot_log.trace for robot, robot_log in log.robots.items()})


@pytest.mark.slow
def test_another_seed_gives_another_trace(shipped_session, tmp_path):
    folder, _ = shipped_session
    simscen("run", "scenarios/navigation/goal.scenario.yaml", "--seed", 2, "--out", tmp_path / "out")
    (other_log,) = (tmp_path / "out").rglob("run.mcap")
    (default_log,) = folder.rglob("goal/seed-1/run.mcap")
    difference = first_difference(read_log(default_log).trace, read_log(other_log).trace)
    assert difference is not None
    assert first_difference(read_log(default_log).trace, read_log(default_log).trace) is None


@pytest.mark.slow
def test_check_determinism_compares_the_logs_of_two_runs(tmp_path):
    out = tmp_path / "out"
    process = simscen("run", "scenarios/navigation/goal.scenario.yaml", "--check-determinism", "--out", out)
    assert process.returncode == 0, process.stdout + process.stderr
    assert len(list(out.rglob("run.mcap"))) == 2


def test_scenarios_page_has_a_row_for_each_shipped_scenario():
    page = (ROOT / "docs/reference/scenarios.md").read_text(encoding="utf-8")
    shipped = {file.relative_to(ROOT).as_posix() for file in (ROOT / "scenarios").rglob("*.scenario.yaml")}
    assert set(re.findall(r"\]\(\.\./\.\./(scenarios/\S+)\)", page)) == shipped
