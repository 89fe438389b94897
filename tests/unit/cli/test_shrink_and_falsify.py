"""Tests of `simscen shrink` and `simscen falsify` on scenarios whose cause of failure is known.

The robot is stationary, and its clearance to crate-3 is too small. All other parts are irrelevant.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml

from simscen.cli.commands import shrink
from simscen.cli.session import falsification
from simscen.cli.session.falsification import Falsification, summary_lines
from simscen.core.errors import UsageError
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.session_events import RunFinished
from simscen.run.sessions.search import SearchMethod

SCENARIO = """\
# Many irrelevant parts, and one cause of failure.
simscen: 1
description: A robot between crates.
world:
  simscen: 1
  walls: [{points: [[0, 0], [12, 0], [12, 12], [0, 12], [0, 0]]}]
  obstacles:
    - {name: crate-1, box: [1, 1, 1], pose: {x: 3, y: 3}}
    - {name: crate-3, box: [1, 1, 1], pose: {x: 7.43, y: 6}}
robot:
  pose: {x: 6, y: 6}
  motor_torque: 83.5 %
stack: {controller: {desired_linear_vel: 0.4}}
faults:
  - {sensor: lidar, noise: {std: 1.5 cm}}
events:
  - {name: new crate, when: {time: 10 ms}, do: {spawn: {name: box, box: [1, 1, 1], pose: {x: 6, y: 10}}}}
time_limit: 61.7 ms
pass:
  - collisions: {max: 0}
  # There must be space to turn.
  - clearance: {min: 1 m}
"""


def load_yaml(file: Path) -> Any:
    return yaml.safe_load(file.read_text())


def runs_of(folder: Path) -> list[Any]:
    runs: list[Any] = json.loads((folder / "results.json").read_text())["runs"]
    return runs


def verdicts_of(run: Any) -> list[Any]:
    return [[verdict["id"], verdict["status"], verdict["findings"]] for verdict in run["verdicts"]]


def test_shrink_keeps_only_the_cause_of_the_failure(simscen: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    result = simscen("shrink", "a.scenario.yaml", "-j", 2)
    assert result.code == 0, result.err
    file = tmp_path / "a.minimal.scenario.yaml"
    shrunk = load_yaml(file)
    assert [item["name"] for item in shrunk["world"]["obstacles"]] == ["crate-3"]
    assert set(shrunk) == {"simscen", "world", "robot", "time_limit", "pass", "seed"}
    assert shrunk["pass"] == [{"clearance": {"min": "1 m"}}]
    assert set(shrunk["robot"]) == {"pose"}
    assert "# There must be space to turn." in file.read_text()
    for text in ("world.obstacles[0] (crate-1)", "events", "faults", "stack", "robot.motor_torque"):
        assert f"  {text}\n" in result.out, result.out
    assert "-> " in result.out
    assert simscen("run", file.name).code == 1


@pytest.mark.slow
def test_a_run_in_an_output_folder_is_shrunk_with_its_variation(simscen: Callable[..., Any], tmp_path: Path) -> None:
    varied = SCENARIO + "variations: {grid: {robot.pose.x: [4, 6], robot.motor_torque: [90 %, 100 %]}}\n"
    (tmp_path / "a.scenario.yaml").write_text(varied)
    assert simscen("run", ".", "--out", "out").code == 1
    run = next(run for run in runs_of(tmp_path / "out") if run["outcome"] == "failed")
    folder = Path("out", run["artifacts"]["mcap"]).parent
    result = simscen("shrink", folder, "--keep-world", "--runs", 8)
    assert result.code == 1, result.err
    shrunk = load_yaml(tmp_path / "a.minimal.scenario.yaml")
    assert shrunk["robot"]["pose"]["x"] == 6
    assert "variations" not in shrunk


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["a.scenario.yaml", "--criterion", "collisions"], "the run did not fail in collisions, but in clearance"),
        (["good.scenario.yaml"], "the run did not fail: passed"),
        (["expected.scenario.yaml"], "remove `expected` from the scenario"),
        (["inconclusive.scenario.yaml"], "the run failed without violating a criterion"),
        (["a.scenario.yaml", "--runs", "1"], "1 run is not enough to reproduce the failure; increase --runs"),
    ],
)
def test_unshrinkable_run_is_an_error(
    simscen: Callable[..., Any], tmp_path: Path, options: list[str], message: str
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    passing_scenario = SCENARIO.replace("min: 1 m", "min: 10 cm")
    (tmp_path / "good.scenario.yaml").write_text(passing_scenario)
    (tmp_path / "expected.scenario.yaml").write_text(f"{SCENARIO}expected: {{fail: clearance}}\n")
    (tmp_path / "inconclusive.scenario.yaml").write_text(f"{passing_scenario}  - smoothness: {{min_sparc: -3}}\n")
    result = simscen("shrink", *options)
    assert result.code == 2
    assert message in result.err
    assert "Traceback" not in result.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["nothing.scenario.yaml"], "no such file"),
        (["a.scenario.yaml", "--out", "a.scenario.yaml"], "exists already"),
        (["a.scenario.yaml", "--out", "a.scenario.yaml/b.scenario.yaml"], "cannot write"),
        ([".", "--seed", "3"], "are for a scenario file"),
        (["."], "is not the folder of a run"),
        (["a.scenario.yaml", "--variation", "x"], "has no variations"),
    ],
)
def test_unusable_options_of_shrink_are_an_error(
    simscen: Callable[..., Any], tmp_path: Path, options: list[str], message: str
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    result = simscen("shrink", *options)
    assert result.code == 2
    assert message in result.err


def test_other_folder_of_a_session_is_not_the_folder_of_a_run(
    simscen: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shrink, "read_journal", lambda _: SimpleNamespace(planned=[]))
    (tmp_path / "out" / "page").mkdir(parents=True)
    (tmp_path / "out" / shrink.JOURNAL_FILE).touch()
    result = simscen("shrink", "out/page")
    assert result.code == 2
    assert "out/page is not the folder of a run" in result.err


@pytest.mark.slow
def test_a_spent_budget_still_writes_a_smaller_scenario(simscen: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    result = simscen("shrink", "a.scenario.yaml", "--runs", 6)
    assert result.code == 1, result.err
    assert "not enough to try everything; increase --runs" in result.out
    assert simscen("run", "a.minimal.scenario.yaml").code == 1
    second = simscen("shrink", "a.scenario.yaml", "--runs", 6, "-j", 1, "--out", "one.scenario.yaml")
    assert second.code == 1
    assert (tmp_path / "one.scenario.yaml").read_bytes() == (tmp_path / "a.minimal.scenario.yaml").read_bytes()


RANGES = """\
variations:
  sampled:
    count: 10
    values:
      robot.pose.x: {uniform: [3, 6]}
      robot.motor_torque: {uniform: [50 %, 100 %]}
"""


@pytest.mark.sample(1)
@pytest.mark.parametrize("method", ["sobol", "tpe", "random"])
def test_a_found_failure_is_written_as_a_scenario_that_fails(
    simscen: Callable[..., Any], tmp_path: Path, method: str
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO + RANGES)
    result = simscen("falsify", "a.scenario.yaml", "--method", method, "--out", "out", "-j", 2)
    assert result.code == 1, result.err
    file = tmp_path / "a.failure-1.scenario.yaml"
    assert 5.6 < load_yaml(file)["robot"]["pose"]["x"] < 6.0  # crate-3 starts at 6.93 m; radius 0.22 m
    assert "variations" not in load_yaml(file)
    assert simscen("run", file.name, "--out", "rerun").code == 1
    (rerun,) = runs_of(tmp_path / "rerun")
    assert verdicts_of(rerun) in [verdicts_of(run) for run in runs_of(tmp_path / "out")]
    assert "smaller: simscen shrink a.failure-1.scenario.yaml" in result.out
    assert {run["again"] for run in runs_of(tmp_path / "out")} == {""}
    assert json.loads((tmp_path / "out/run.json").read_text()).keys() >= {"plugins", "stacks"}
    assert "--variation" not in result.out
    if method == "tpe":  # the method that depends on the order of the results
        simscen("falsify", "a.scenario.yaml", "--method", method, "--out", "out1", "-j", 1)
        assert (tmp_path / "out/results.json").read_bytes() == (tmp_path / "out1/results.json").read_bytes()


def test_search_that_could_not_save_a_failure_does_not_start(simscen: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / f"{238 * 'a'}.scenario.yaml"  # its name with `.failure-1` is too long
    file.write_text(SCENARIO + RANGES)
    result = simscen("falsify", file.name, "--out", "out")
    assert result.code == 2
    assert "File name too long" in result.err
    assert not (tmp_path / "out").exists()


def test_interrupted_runs_do_not_count_as_searched() -> None:
    failures = [None, RunFailure("interrupted", "x"), RunFailure("not-run", "x")]
    outcomes = [Outcome.PASSED, Outcome.ERROR, Outcome.ERROR]
    search = SimpleNamespace(
        finished_runs=[
            RunFinished(RunResult(RunKey("a", 1), "a", outcome, error=failure))
            for outcome, failure in zip(outcomes, failures, strict=True)
        ],
        failures=[],
        max_failure_rate=lambda: None,
        is_probability_shown=True,
    )
    assert summary_lines(search) == ["found no failure in 1 run"]  # type: ignore[arg-type]


@pytest.mark.parametrize(("limit", "is_shown"), [(None, True), (0.2, True), (0.19, False)])
def test_passed_runs_show_a_failure_rate_above_their_confidence_bound(limit: float | None, is_shown: bool) -> None:
    search = object.__new__(Falsification)
    search._request = SimpleNamespace(probability=limit, method=SearchMethod.RANDOM)  # type: ignore[assignment]
    # 1 - 0.05 ** (1 / 14) = 0.1926
    search.finished_runs = [RunFinished(RunResult(RunKey("a", 1), "a", Outcome.PASSED)) for _ in range(14)]
    search.failures = []
    assert search.is_probability_shown == is_shown
    assert ("undecided: too few runs for --probability; increase --runs" in summary_lines(search)) != is_shown


@pytest.mark.slow
def test_random_search_with_too_few_runs_for_its_probability_is_undecided(
    simscen: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO + RANGES.replace("[3, 6]", "[3, 5]"))
    options = ("--method", "random", "--probability", "0.1", "--runs", "8")
    result = simscen("falsify", "a.scenario.yaml", *options)
    assert result.code == 6, result.err
    assert "undecided: too few runs for --probability; increase --runs" in result.out


@pytest.mark.slow
def test_random_search_without_a_failure_bounds_the_failure_rate(simscen: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO + RANGES.replace("[3, 6]", "[3, 5]"))
    result = simscen("falsify", "a.scenario.yaml", "--method", "random", "--probability", "0.1")
    assert result.code == 0, result.err
    assert "found no failure in 32 runs" in result.out  # 29 are needed, in batches of 8
    assert "with 95% confidence, at most 8.94 % of random values fail" in result.out  # 1 - 0.05 ** (1 / 32)
    assert not list(tmp_path.glob("*.failure-*"))


@pytest.mark.parametrize(
    ("ranges", "options", "message"),
    [
        ("", [], "has no `variations` to search"),
        ("variations: {grid: {seed: [1, 2]}}\n", [], "only the ranges of `sampled` can be searched"),
        (RANGES + "  pairwise: {seed: [1, 2]}\n", [], "only the ranges of `sampled` can be searched"),
        (RANGES + "  require: ['robot.pose.x > 7']\n", [], "meets the conditions in `require`"),
        (RANGES.replace("[3, 6]", "[-5, -4]"), [], "error[SC301]"),
        (RANGES + "skip: later\n", [], "is marked with `skip`: later"),
        (RANGES + "expected: {fail: known}\n", [], "is marked with `expected`; remove it to search for failures"),
        (RANGES, ["--method", "sobol", "--probability", "0.1"], "--probability needs --method random"),
    ],
)
def test_unsearchable_scenario_is_an_error(
    simscen: Callable[..., Any], tmp_path: Path, ranges: str, options: list[str], message: str
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO + ranges)
    result = simscen("falsify", "a.scenario.yaml", *options)
    assert result.code == (5 if "skip" in ranges else 2)
    assert message in result.err
    if "marked" in message:
        assert not (tmp_path / "simscen-out").exists()


TORQUES = "variations: {sampled: {count: 4, values: {robot.motor_torque: {uniform: [50 %, 100 %]}}}}\n"
SOBOL = ("falsify", "crates.scenario.yaml", "--method", "sobol", "--runs", "4", "--out", "out")


def change_before_batch(monkeypatch: pytest.MonkeyPatch, number: int, change: Callable[[], object]) -> None:
    """Make batches of two runs, and call `change` before the batch `number` (from 0)."""
    make_jobs = Falsification._make_jobs

    def make_jobs_after_change(search: Any, points: Any, folder: Path) -> Any:
        if len(search.finished_runs) == 2 * number:
            change()
        return make_jobs(search, points, folder)

    monkeypatch.setattr(falsification, "BATCH_SIZE", 2)
    monkeypatch.setattr(Falsification, "_make_jobs", make_jobs_after_change)


def test_runs_before_an_error_during_a_search_are_reported(
    simscen: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> None:
        raise UsageError("something is wrong")

    text = SCENARIO.replace("clearance: {min: 1 m}", "clearance: {min: 0.1 m}")
    (tmp_path / "crates.scenario.yaml").write_text(text + TORQUES)
    change_before_batch(monkeypatch, 1, fail)
    assert simscen(*SOBOL).code == 2
    assert len(runs_of(tmp_path / "out")) == 2


SIGNAL_BETWEEN_BATCHES = f"""
import os, signal, sys
from simscen.cli.session import falsification

make_jobs = falsification.Falsification._make_jobs

def make_jobs_after_signal(self, points, folder):
    if self.finished_runs:
        os.kill(os.getpid(), signal.SIGTERM)
    return make_jobs(self, points, folder)

falsification.BATCH_SIZE = 2
falsification.Falsification._make_jobs = make_jobs_after_signal
sys.argv = {["simscen", *SOBOL]}
from simscen.cli.main import main
main()
"""


def test_runs_before_a_signal_during_a_search_are_reported(tmp_path: Path) -> None:
    text = SCENARIO.replace("clearance: {min: 1 m}", "clearance: {min: 0.1 m}")
    (tmp_path / "crates.scenario.yaml").write_text(text + TORQUES)
    program = [sys.executable, "-c", SIGNAL_BETWEEN_BATCHES]
    result = subprocess.run(program, cwd=tmp_path, check=False, capture_output=True, text=True)
    assert result.returncode == 143, result.stderr
    assert len(runs_of(tmp_path / "out")) == 2


def test_an_interrupted_search_without_runs_names_no_report(
    simscen: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "crates.scenario.yaml").write_text(SCENARIO + TORQUES)
    change_before_batch(monkeypatch, 0, lambda: os.kill(os.getpid(), signal.SIGTERM))
    result = simscen(*SOBOL)
    assert result.code == 143, result.err
    assert "interrupted: 0 passed" in result.out
    assert "--resume" not in result.out  # simscen falsify has no such option
    assert "report.html" not in result.out and not (tmp_path / "out/report.html").exists()


def test_the_junit_report_of_a_search_does_not_replace_its_world(simscen: Callable[..., Any], tmp_path: Path) -> None:
    world = "simscen: 1\nwalls: [{points: [[0, 0], [12, 0], [12, 12], [0, 12], [0, 0]]}]\n"
    (tmp_path / "hall.world.yaml").write_text(world)
    start, end = SCENARIO.partition("world:\n")[0], SCENARIO.partition("robot:\n")[2]
    (tmp_path / "a.scenario.yaml").write_text(f"{start}world: hall.world.yaml\nrobot:\n{end}{RANGES}")
    result = simscen("falsify", "a.scenario.yaml", "--runs", "1", "--junit", "hall.world.yaml")
    assert result.code == 2, result.out
    assert "cannot write hall.world.yaml: it is one of the input files" in result.err
    assert (tmp_path / "hall.world.yaml").read_text() == world
