"""`simscen study`: claims and parameters of a scenario whose margin is known in closed form.

The robot is `x` from the wall behind it, and the criterion needs 1 m of clearance.
"""

import json
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from simscen.cli.session import study_session

WORLD = "{simscen: 1, walls: [{points: [[0, 0], [20, 0], [20, 20], [0, 20], [0, 0]]}]}"
SCENARIO = f"""\
simscen: 1
world: {WORLD}
robot: {{pose: {{x: 1, y: 10}}}}
goals: []
time_limit: 50 ms
pass: [{{clearance: {{min: 1 m}}}}]
"""
RANDOM = """\
variations:
  sampled:
    count: 24
    values:
      robot.pose.x: {uniform: [0.8 m, 2 m]}
      robot.motor_torque: {uniform: [0.5, 1]}
"""


@pytest.fixture
def study(simscen: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    """Return a function that runs a study of a scenario, given as text, with options."""

    def run(text: str, *options: object) -> Any:
        (tmp_path / "s.study.yaml").write_text(text)
        return simscen("study", "s.study.yaml", *map(str, options))

    return run


def results(folder: Path, name: str = "out") -> Any:
    return json.loads((folder / name / "results.json").read_text())


def case(folder: Path) -> ET.Element:
    testcase = ET.parse(folder / "out/junit.xml").find("testsuite/testcase")
    assert testcase is not None
    return testcase


def test_study_finds_the_parameter_that_lowers_the_margin(study: Callable[..., Any], tmp_path: Path) -> None:
    result = study(SCENARIO + RANDOM, "--out", "out")
    assert result.code == 1, result.err
    runs = [line for line in result.out.splitlines() if line.startswith("  ") and " s simulated" in line]
    columns = {line.index(" s simulated") for line in runs}
    assert len(columns) == 1
    output = results(tmp_path)["study"]
    xs = [float(row["values"]["robot.pose.x"].removesuffix(" m")) for row in output["values"]]
    radius = 0.22 + 0.05  # radius of the robot, and half the thickness of the wall
    expected = sum(x - radius >= 1.0 for x in xs)
    assert output["passed"] == pytest.approx(expected, abs=1)  # the robot moves while it settles
    assert output["passed"] + output["failed"] == 24
    assert [row["seed"] for row in output["values"]] == [
        int(row["variation"].removeprefix("variation-")) for row in output["values"]
    ]
    strongest, *others = output["effects"]
    assert (strongest["path"], strongest["criterion"]) == ("robot.pose.x", "clearance")
    assert strongest["effect"] == pytest.approx(1.0)
    assert strongest["p"] < 1e-6
    assert all(other["p"] > 0.05 for other in others)
    rates = [row["passed"] / row["runs"] for row in output["rates"] if row["path"] == "robot.pose.x"]
    assert rates == sorted(rates)
    assert rates[-1] == 1.0
    worst = output["worst"]["clearance"]
    assert worst["margin"] == pytest.approx(min(xs) - radius - 1.0, abs=2e-3)
    assert "robot.pose.x on clearance   +1.00" in result.out
    page = (tmp_path / "out/report.html").read_text()
    assert "margin of clearance against robot.pose.x" in page
    assert page.count('<circle class="bad"') == 2 * output["failed"]
    assert 'href="./runs/s.study/' in page


def test_results_do_not_depend_on_the_number_of_workers_or_on_batches(
    study: Callable[..., Any], simscen: Callable[..., Any], tmp_path: Path
) -> None:
    text = SCENARIO + RANDOM + "acceptance: {pass_rate: {min: 50 %, method: anytime, runs: 5}}\n"
    for workers in (1, 2):
        study(text, "--out", f"out{workers}", "-j", workers)
    assert (tmp_path / "out1/results.json").read_bytes() == (tmp_path / "out2/results.json").read_bytes()
    assert simscen("report", "out1").code in (0, 6)
    assert (tmp_path / "out1/results.json").read_bytes() == (tmp_path / "out2/results.json").read_bytes()


@pytest.mark.parametrize(
    ("x", "claim", "code", "status", "element"),
    [
        pytest.param("2 m", "{min: 80 %}", 0, "held", "system-out", marks=pytest.mark.slow),
        ("1 m", "{min: 80 %}", 1, "refuted", "failure"),
        pytest.param("1 m", "{min: 80 %, method: sprt, target: 90 %}", 1, "refuted", "failure", marks=pytest.mark.slow),
        ("2 m", "{min: 80 %, runs: 5}", 6, "undecided", "error"),
    ],
)
def test_a_claim_has_its_own_exit_code_and_testcase(
    study: Callable[..., Any], tmp_path: Path, x: str, claim: str, code: int, status: str, element: str
) -> None:
    text = SCENARIO.replace("{x: 1,", f"{{x: {x},") + f"acceptance: {{pass_rate: {claim}}}\n"
    result = study(text, "--out", "out")
    assert result.code == code, result.err
    assert results(tmp_path)["study"]["claim"]["status"] == status
    testcase = case(tmp_path)
    assert testcase.get("name", "").startswith("s.study [pass rate >= 0.8 (confidence 0.95)]")
    assert [child.tag for child in testcase] == [element]
    if element == "error":
        assert testcase[0].get("type") == "simscen.undecided"
    assert f"claim: pass rate of at least 80 % with 95 % confidence: {status}" in result.out


@pytest.mark.slow
def test_a_sequential_claim_stops_early_and_can_be_resumed(study: Callable[..., Any], tmp_path: Path) -> None:
    text = SCENARIO.replace("{x: 1,", "{x: 2,") + "acceptance: {pass_rate: {min: 80 %, method: anytime, runs: 500}}\n"
    assert study(text, "--out", "out").code == 0
    output = results(tmp_path)
    assert output["total"] == 32
    assert output["study"]["claim"]["runs"] < 32
    resumed = study(text, "--resume", "out")
    assert resumed.code == 0
    assert all(run["resumed"] for run in results(tmp_path)["runs"])
    assert results(tmp_path)["study"] == output["study"]


@pytest.mark.slow
def test_pairwise_values_have_no_confidence_interval_and_no_claim(study: Callable[..., Any], tmp_path: Path) -> None:
    pairwise = (
        "variations: {pairwise: {robot.pose.x: [1 m, 2 m, 3 m], robot.pose.y: [9, 10, 11], "
        "robot.motor_torque: [0.8, 0.9, 1]}}\n"
    )
    result = study(SCENARIO + pairwise, "--out", "out", "--repeat", 2)
    assert result.code == 1, result.err
    output = results(tmp_path)["study"]
    assert output["sampling"] == "designed"
    assert output["interval"] is None
    assert output["pair_coverage"] == 1.0
    assert output["passed"] + output["failed"] == 20
    assert "the values were chosen" in result.out
    claimed = study(SCENARIO + pairwise + "acceptance: {pass_rate: {min: 80 %}}\n")
    assert claimed.code == 2
    assert "not independent random draws" in claimed.err


@pytest.mark.slow
def test_values_meet_the_conditions_and_their_share_is_reported(study: Callable[..., Any], tmp_path: Path) -> None:
    text = SCENARIO + RANDOM + "  require: ['robot.pose.x > 1.4']\n"
    result = study(text, "--out", "out")
    assert result.code == 0, result.err
    output = results(tmp_path)["study"]
    assert output["passed"] == 24
    assert 0.3 < output["accepted"] < 0.7
    last = max(int(row["variation"].removeprefix("variation-")) for row in output["values"])
    assert output["accepted"] == pytest.approx(24 / last)
    impossible = study(SCENARIO + RANDOM + "  require: ['robot.pose.x > 9']\n")
    assert impossible.code == 2
    assert "none of 10000 draws in a row meets the conditions" in impossible.err


@pytest.mark.slow
def test_printed_command_repeats_a_failed_run(
    study: Callable[..., Any], simscen: Callable[..., Any], tmp_path: Path
) -> None:
    study(SCENARIO + RANDOM.replace("count: 24", "count: 2000"), "--out", "out", "--runs", 8)
    runs = results(tmp_path)["runs"]
    failed = next(run for run in runs if run["outcome"] == "failed")
    assert simscen(*failed["again"].split()[1:], "--out", "again").code == 1
    (run,) = results(tmp_path, "again")["runs"]
    assert run["verdicts"] == failed["verdicts"]


@pytest.mark.parametrize(
    ("extra_text", "options", "message"),
    [
        ("", [], "the number of runs is missing"),
        ("variations: {grid: {seed: [1, 2]}}\n", ["--runs", 3], "--runs is for random seeds"),
        ("", ["--runs", 3, "--repeat", 2], "--repeat is for chosen values"),
        ("skip: later\n", ["--runs", 3], "is marked with `skip`"),
        ("variations: {grid: {seed: [1, 2]}, require: ['nothing.here > 1']}\n", [], "neither varied nor written"),
        ("variations: {grid: {seed: [1, 2]}, require: ['seed >']}\n", [], "is not a condition"),
        ("variations: {grid: {seed: [1, 2]}, require: ['seed > 2']}\n", [], "no variation meets the conditions"),
    ],
)
def test_invalid_studies_are_refused(
    simscen: Callable[..., Any], tmp_path: Path, extra_text: str, options: list[object], message: str
) -> None:
    (tmp_path / "s.study.yaml").write_text(SCENARIO + extra_text)
    result = simscen("study", "s.study.yaml", *map(str, options))
    assert result.code in (2, 5)
    assert message in result.err


def test_pairs_are_counted_only_for_pairwise_values(study: Callable[..., Any], tmp_path: Path) -> None:
    study(SCENARIO + "variations: {pairs: {robot.pose.x: [1 m, 2 m], robot.pose.y: [9, 10]}}\n", "--out", "out")
    assert results(tmp_path)["study"]["pair_coverage"] is None


def test_logs_of_passed_runs_are_deleted_on_request(
    study: Callable[..., Any], simscen: Callable[..., Any], tmp_path: Path
) -> None:
    study(SCENARIO + RANDOM, "--out", "out", "--runs", 6, "--keep-logs", "failed")
    runs = results(tmp_path)["runs"]
    assert {run["outcome"] for run in runs} == {"passed", "failed"}
    for run in runs:
        folder = tmp_path / "out" / Path(run["artifacts"]["result"]).parent
        assert ("mcap" in run["artifacts"]) == (run["outcome"] == "failed")
        assert (folder / "run.mcap").exists() == (run["outcome"] == "failed")
        assert [file.name for file in folder.iterdir()] == ["result.json"] or run["outcome"] == "failed"
    original = (tmp_path / "out/results.json").read_bytes()
    assert simscen("report", "out").code == 1
    assert (tmp_path / "out/results.json").read_bytes() == original


def test_runs_before_an_error_between_two_batches_are_reported(
    study: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded_batches, load = count(1), study_session._StudySession._load

    def load_after_change(session: Any, numbers: Any) -> Any:
        if next(loaded_batches) == 3:  # the second batch; the first one is loaded in two calls
            with (tmp_path / "s.study.yaml").open("a") as file:
                file.write("# changed")
        return load(session, numbers)

    monkeypatch.setattr(study_session, "BATCH_SIZE", 4)
    monkeypatch.setattr(study_session._StudySession, "_load", load_after_change)
    result = study(SCENARIO + RANDOM, "--out", "out")
    assert result.code == 2
    assert "s.study.yaml has changed since the study began" in result.err
    assert results(tmp_path)["total"] == 4


SIGNAL_BETWEEN_BATCHES = """
import os, signal, sys
from simscen.cli.session import study_session

loaded_batches = 0
load = study_session._StudySession._load

def load_after_signal(self, numbers):
    global loaded_batches
    loaded_batches += 1
    if loaded_batches == 3:
        os.kill(os.getpid(), signal.SIGTERM)
    return load(self, numbers)

study_session.BATCH_SIZE = 4
study_session._StudySession._load = load_after_signal
sys.argv = ["simscen", "study", "s.study.yaml", "--out", "out"]
from simscen.cli.main import main
main()
"""


def test_runs_before_a_signal_between_two_batches_are_reported(tmp_path: Path) -> None:
    (tmp_path / "s.study.yaml").write_text(SCENARIO + RANDOM)
    program = [sys.executable, "-c", SIGNAL_BETWEEN_BATCHES]
    result = subprocess.run(program, cwd=tmp_path, check=False, capture_output=True, text=True)
    assert result.returncode == 143, result.stderr
    assert results(tmp_path)["total"] == 4
