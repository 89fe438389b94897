"""Tests of `variations`: each variation is a separate run in all reports."""

import json
import shlex
from pathlib import Path
from xml.etree import ElementTree

import pytest

import simscen as package
from simscen.core.errors import UsageError

SHORT = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
variations: {grid: {robot.pose.x: [1, 2, 50 cm]}}
"""
NAMES = ["x=1", "x=2", "x=50cm"]


@pytest.fixture
def project(simscen, tmp_path: Path) -> Path:
    """Return a folder with a scenario of one second that has three variations."""
    (tmp_path / "good.scenario.yaml").unlink()
    (tmp_path / "a.scenario.yaml").write_text(SHORT)
    return tmp_path


def results(folder: Path) -> list[dict[str, object]]:
    """Return the runs of results.json."""
    runs: list[dict[str, object]] = json.loads((folder / "results.json").read_text())["runs"]
    return runs


def test_every_variation_runs_with_every_seed(simscen, project: Path) -> None:
    result = simscen("run", ".", "--repeat", "2", "--out", "out")
    assert result.code == 0, result.err
    assert result.out.startswith("simscen")
    assert "1 scenario · 6 runs" in result.out
    assert "a[x=50cm] (seed 2)" in result.out
    folders = sorted(log.parent.name for log in project.rglob("run.mcap"))
    assert folders == sorted(f"seed-{seed}-{name}" for seed in (1, 2) for name in NAMES)
    assert [(run["variation"], run["seed"]) for run in results(project / "out")] == [
        (n, s) for n in NAMES for s in (1, 2)
    ]
    cases = [case.get("name") for case in ElementTree.parse(project / "out/junit.xml").iter("testcase")]
    assert sorted(map(str, cases)) == sorted(f"a [{name}, seed {seed}]" for name in NAMES for seed in (1, 2))
    resolved = (project / "out/runs/a/seed-1-x=50cm/scenario.yaml").read_text()
    assert "x: 50 cm" in resolved
    assert "variations" not in resolved
    judged = json.loads(simscen("judge", "out", "--json").out)
    assert sorted({run["variation"] for run in judged["runs"]}) == NAMES
    assert "a[x=2]" in (project / "out/report.html").read_text()


@pytest.mark.slow
def test_repeat_command_repeats_one_variation(simscen, project: Path) -> None:
    simscen("run", ".", "--seed", "7", "-k", "x=50cm", "--out", "out")
    (run,) = results(project / "out")
    assert run["again"] == "simscen run a.scenario.yaml --seed 7 --variation x=50cm"
    assert simscen(*shlex.split(str(run["again"]))[1:], "--out", "again").code == 0
    logs = [project / f"{folder}/runs/a/seed-7-x=50cm/run.mcap" for folder in ("out", "again")]
    assert logs[0].read_bytes() == logs[1].read_bytes()


@pytest.mark.slow
def test_stacks_are_compared_for_each_variation(simscen, project: Path) -> None:
    (project / "dwb.stack.yaml").write_text("simscen: 1\nstack: {controller: {type: dwb}}\n")
    stack_options = ("--stack", "ref=reference", "--stack", "dwb=dwb.stack.yaml")
    result = simscen("run", ".", *stack_options, "-k", "x=1 or x=2", "--check-determinism", "--out", "out")
    assert result.code == 0, result.out
    assert "dwb against ref: 2 pairs" in result.out
    folders = {log.parent.name for log in project.rglob("run.mcap")}
    assert {"seed-1-x=1@ref", "seed-1-x=2@dwb", "seed-1-x=2@dwb.again"} < folders
    document = json.loads((project / "out/results.json").read_text())
    assert [row["scenario"] for row in document["comparison"]["scenarios"]] == ["a[x=1]", "a[x=2]"]


@pytest.mark.slow
def test_resume_runs_missing_variations(simscen, project: Path) -> None:
    assert simscen("run", ".", "--variation", "x=1", "--out", "out").code == 0
    original_time = (project / "out/runs/a/seed-1-x=1/run.mcap").stat().st_mtime_ns
    assert simscen("run", ".", "--resume", "out").code == 0
    assert (project / "out/runs/a/seed-1-x=1/run.mcap").stat().st_mtime_ns == original_time
    assert [run["variation"] for run in results(project / "out")] == NAMES


def test_shards_and_lists_contain_variations(simscen, project: Path) -> None:
    assert simscen("list", ".").out.split() == [f"a[{name}]" for name in NAMES]
    shards = [simscen("run", ".", "--shard", f"{k}/2", "--out", f"out{k}").out for k in (1, 2)]
    assert sorted(name for text in shards for name in NAMES if f"a[{name}]" in text) == sorted(NAMES)


def test_unknown_variation_is_an_error_with_a_suggestion(simscen, project: Path) -> None:
    result = simscen("run", ".", "--variation", "x=51cm")
    assert result.code == 5
    assert "no variation is called `x=51cm`; did you mean `x=50cm`?" in result.err


def test_geometric_problem_names_its_variation(simscen, project: Path) -> None:
    (project / "a.scenario.yaml").write_text(SHORT.replace("50 cm", "5.95"))
    result = simscen("validate", ".")
    assert result.code == 2
    assert "error[SC301] the robot's start (5.95, 1) is inside obstacle" in result.out
    assert "in the variation `x=5.95`" in result.out
    assert simscen("run", ".", "--variation", "x=1").code == 2


def test_variation_of_a_replaced_stack_is_rejected(simscen, project: Path) -> None:
    grid = "{grid: {stack.controller.desired_linear_vel: [0.1, 0.2]}}"
    (project / "a.scenario.yaml").write_text(SHORT.replace("{grid: {robot.pose.x: [1, 2, 50 cm]}}", grid))
    result = simscen("run", "a.scenario.yaml", "--stack", "mine=/bin/true")
    assert result.code == 2
    assert "`stack.controller.desired_linear_vel` changes nothing with --stack mine=/bin/true" in result.err


def test_python_interface_lists_and_runs_variations(project: Path) -> None:
    assert package.variations("a.scenario.yaml") == NAMES
    run = package.simulate("a.scenario.yaml", variation="x=2")
    assert run.result.key.variation == "x=2"
    assert run.trace.truth.values[0][0] == pytest.approx(2, abs=0.01)
    with pytest.raises(UsageError, match="has 3 variations: choose one; expected one of: x=1, x=2, x=50cm"):
        package.simulate("a.scenario.yaml")
    (project / "plain.scenario.yaml").write_text(SHORT[: SHORT.index("variations")])
    assert package.variations("plain.scenario.yaml") == [""]
