"""Tests of `--resume`, which keeps the verdicts of runs whose logs exist, and marks these runs."""

import json
import shutil
from xml.etree import ElementTree

import pytest

WORLD = "{simscen: 1, walls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}]}"
SCENARIO = f"""\
simscen: 1
world: {WORLD}
robot: {{pose: {{x: 2, y: 2}}}}
goals: []
time_limit: TIME
pass: [{{collisions: {{max: 0}}}}]
"""


RUN = ("run", "a.scenario.yaml", "b.scenario.yaml", "-j", "1")


@pytest.fixture(scope="module")
def finished(simscen_in, tmp_path_factory):
    """Return a folder with two scenarios and their finished session."""
    folder = tmp_path_factory.mktemp("finished")
    for name, seconds in (("a", "0.2"), ("b", "0.3")):
        (folder / f"{name}.scenario.yaml").write_text(SCENARIO.replace("TIME", seconds))
    assert simscen_in(folder, *RUN, "--out", "out").code == 0
    return folder


@pytest.fixture
def session(finished, simscen, tmp_path):
    """Return the folder of a copy of the finished session, and a function that resumes it and returns its output."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)

    def resume():
        result = simscen(*RUN, "--resume", "out")
        assert result.code == 0
        return result.out

    return tmp_path / "out", resume


def kept_scenarios(folder):
    runs = json.loads((folder / "results.json").read_text())["runs"]
    return [run["scenario"] for run in runs if run.get("resumed")]


def test_kept_verdicts_are_marked_in_console_and_reports(session):
    folder, resume = session
    assert kept_scenarios(folder) == []
    assert resume().count(", kept") == 2
    assert kept_scenarios(folder) == ["a", "b"]
    marks = ElementTree.parse(folder / "junit.xml").findall(".//property[@name='resumed']")
    assert [mark.get("value") for mark in marks] == ["true", "true"]


@pytest.mark.sample(1)
@pytest.mark.parametrize("damage", ["deleted", "replaced", "cut", "emptied"])
def test_run_with_missing_or_changed_log_is_repeated(session, damage):
    folder, resume = session
    log, other = folder / "runs/a/seed-1/run.mcap", folder / "runs/b/seed-1/run.mcap"
    original = log.read_bytes()
    match damage:
        case "deleted":
            log.unlink()
        case "replaced":
            log.write_bytes(other.read_bytes())
        case "cut":
            log.write_bytes(original[: len(original) // 2])
        case "emptied":
            log.write_bytes(b"")
    assert resume().count(", kept") == 1
    assert kept_scenarios(folder) == ["b"]
    assert log.read_bytes() == original


def test_runs_that_are_not_selected_again_are_named(session, simscen):
    """Otherwise, a failed session could pass when it is resumed with a smaller selection."""
    folder, _ = session
    result = simscen("run", "b.scenario.yaml", "--resume", "out")
    assert result.code == 0
    warning = "1 run of 2 of the session to resume, such as a (seed 1), will not be in its reports"
    assert result.err == f"simscen: warning: out: {warning}, because the selection has changed\n"
    assert json.loads((folder / "results.json").read_text())["total"] == 1


def test_session_that_was_killed_before_it_planned_its_runs_starts_again(session):
    folder, resume = session
    shutil.rmtree(folder)
    folder.mkdir()
    (folder / "events.jsonl").touch()
    assert "2 passed" in resume()
