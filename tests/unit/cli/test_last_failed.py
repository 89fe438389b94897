"""Tests of `simscen run --last-failed`, which works as the option of pytest."""

import json
from pathlib import Path

import pytest

ROOM = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 0.5 s
pass: [{collisions: {max: 0}}]
"""
FAILING = ROOM.replace("collisions: {max: 0}", "clearance: {min: 2}")


@pytest.fixture
def project(simscen, tmp_path: Path):
    """Return a folder with a scenario that passes and two scenarios that fail."""
    (tmp_path / "good.scenario.yaml").unlink()
    for name, text in (("a", ROOM), ("b", FAILING), ("c", FAILING)):
        (tmp_path / f"{name}.scenario.yaml").write_text(text)
    return tmp_path


def runs_of(folder: Path) -> list[tuple[str, int, str]]:
    document = json.loads((folder / "simscen-out/latest/results.json").read_text())
    return [(run["scenario"], run["seed"], run["outcome"]) for run in document["runs"]]


@pytest.mark.slow
def test_only_failed_runs_are_repeated(simscen, project: Path) -> None:
    result = simscen("run", ".", "--last-failed")
    assert result.err == "simscen: there is no earlier session in simscen-out: all selected scenarios run\n"
    assert len(runs_of(project)) == 3
    result = simscen("run", ".", "--lf")
    assert (result.code, result.err) == (1, "simscen: 2 runs failed when last run\n")
    assert runs_of(project) == [("b", 1, "failed"), ("c", 1, "failed")]
    (project / "b.scenario.yaml").write_text(ROOM)
    (project / "new.scenario.yaml").write_text(FAILING)
    (project / "c.scenario.yaml").rename(project / "d.scenario.yaml")
    result = simscen("run", ".", "--lf")
    assert (result.code, result.err) == (0, "simscen: 2 runs failed when last run: 1 selected, 1 not\n")
    assert runs_of(project) == [("b", 1, "passed")]
    result = simscen("run", "a.scenario.yaml", "--lf")
    assert result.err == "simscen: 1 run failed when last run, but none is selected: all selected scenarios run\n"
    assert runs_of(project) == [("a", 1, "passed")]


@pytest.mark.slow
def test_failed_run_keeps_its_seed(simscen, project: Path) -> None:
    simscen("run", "b.scenario.yaml", "--repeat", "2", "--seed", "7")
    simscen("run", "b.scenario.yaml", "--lf")
    assert runs_of(project) == [("b", 7, "failed"), ("b", 8, "failed")]
    simscen("run", "b.scenario.yaml", "--lf", "--seed", "8")
    assert runs_of(project) == [("b", 8, "failed")]


@pytest.mark.slow
def test_sessions_are_searched_next_to_the_output_folder(simscen, project: Path) -> None:
    simscen("run", "a.scenario.yaml", "--out", "ci/1")
    result = simscen("run", "a.scenario.yaml", "--out", "ci/2", "--lf")
    message = f"simscen: no run in {project}/ci failed when it last ran: all selected scenarios run\n"
    assert (result.code, result.err) == (0, message)


def test_last_failed_and_resume_exclude_each_other(simscen, project: Path) -> None:
    result = simscen("run", ".", "--resume", "out", "--last-failed")
    assert (result.code, result.err) == (2, "simscen: --last-failed and --resume exclude each other\n")
