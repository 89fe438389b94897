"""Tests of the pytest plug-in in a separate pytest process."""

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOM = """\
simscen: 1
tags: [smoke]
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 0.5 s
pass: [{collisions: {max: 0}}]
"""
FAILING = ROOM.replace("collisions: {max: 0}", "clearance: {min: 2}").replace("smoke", "skip, far")
FILES = {
    "scenarios/good.scenario.yaml": ROOM,
    "scenarios/bad.scenario.yaml": FAILING,
    "scenarios/known.scenario.yaml": FAILING + "expected: {fail: too near to the wall, criteria: [clearance]}\n",
    "scenarios/held.scenario.yaml": ROOM + "expected: {fail: no more, criteria: [collisions]}\n",
    "scenarios/later.scenario.yaml": ROOM + "skip: the dock is being built\n",
    "scenarios/speeds.scenario.yaml": ROOM + "variations: {grid: {time_limit: [0.1 s, 0.2 s]}}\n",
    "test_own.py": "def test_own():\n    pass\n",
}
TEST = """
import pytest


def test_passes(simscen):
    run = simscen("scenarios/good.scenario.yaml", seed=7)
    assert run.passed
    assert run.result.metrics["collisions"] == 0
    assert run.trace.end == 120
    assert run.log.is_file()
    assert simscen.variations("scenarios/speeds.scenario.yaml") != [""]


def test_fails(simscen):
    assert simscen("scenarios/bad.scenario.yaml").passed
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a project with scenarios of every outcome and a Python test."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


@pytest.fixture
def run(project: Path):
    """Return a function that runs pytest in the project, and returns its exit code and output."""

    def call(*arguments: str, folder: str = ".") -> tuple[int, str]:
        plugin = ("-p", "no:simscen", "-p", "simscen.testing.plugin", "--strict-markers", "--color=no")
        result = subprocess.run(
            [sys.executable, "-m", "pytest", *plugin, *arguments],
            cwd=project / folder, capture_output=True, text=True, check=False,
        )  # fmt: skip
        return result.returncode, result.stdout + result.stderr

    return call


def collected_items(output: str) -> list[str]:
    """Return the ids of the items in the output of `--collect-only -q`."""
    return [line for line in output.splitlines() if "::" in line]


def test_without_configuration_nothing_is_collected(run, project: Path) -> None:
    code, output = run("--collect-only", "-q")
    assert (code, collected_items(output)) == (0, ["test_own.py::test_own"])
    assert not (project / "simscen-out").exists()


def test_problems_name_files_relative_to_the_working_folder(run, project: Path) -> None:
    (project / ".git").mkdir()  # the root of the scenarios
    (project / "scenarios/wrong.scenario.yaml").write_text(ROOM.replace("goals", "gaols"))
    code, output = run("--collect-only", "wrong.scenario.yaml", folder="scenarios")
    assert code == 2, output
    assert "\nwrong.scenario.yaml:5:1: error[SC012]" in output


@pytest.mark.slow
def test_scenarios_are_collected_only_in_the_configured_folders(run, project: Path) -> None:
    (project / "pytest.ini").write_text("[pytest]\nsimscen_paths = scenarios\nsimscen_seed = 9\n")
    (project / "other").mkdir()
    (project / "other/elsewhere.scenario.yaml").write_text(ROOM)
    (project / "named.scenario.yaml").write_text(ROOM)
    paths = ("scenarios", "other", "test_own.py", "named.scenario.yaml")
    code, output = run("--collect-only", "-q", "-k", "good or elsewhere or named or test_own", *paths)
    assert code == 0, output
    assert sorted(collected_items(output)) == [
        "named.scenario.yaml::named", "scenarios/good.scenario.yaml::good", "test_own.py::test_own"
    ]  # fmt: skip


def test_runs_are_items_with_their_tags_as_markers_and_invalid_files_are_errors(run, project: Path) -> None:
    (project / "scenarios/wrong.scenario.yaml").write_text(ROOM.replace("goals", "gaols"))
    (project / "scenarios/private.scenario.yaml").write_text(ROOM.replace("[smoke]", "[_private]"))
    code, output = run("--simscen", "--collect-only", "-q", "scenarios", "--simscen-repeat", "2", "-m", "smoke")
    assert code == 2, output
    assert "_private" not in output, "a tag that starts with an underscore is not a marker"
    assert "wrong.scenario.yaml:5:1: error[SC012]" in output and "Traceback" not in output
    names = [line.partition("::")[2] for line in collected_items(output)]
    assert names == [
        "good (seed 1)", "good (seed 2)", "held (seed 1)", "held (seed 2)", "later (seed 1)", "later (seed 2)",
        "speeds[time_limit=0.1s] (seed 1)", "speeds[time_limit=0.1s] (seed 2)",
        "speeds[time_limit=0.2s] (seed 1)", "speeds[time_limit=0.2s] (seed 2)",
    ]  # fmt: skip


@pytest.mark.slow
def test_items_pass_fail_skip_and_xfail_with_the_messages_of_simscen(run, project: Path) -> None:
    code, output = run("--simscen", "-p", "no:xdist", "scenarios", "--junitxml=junit.xml", "--simscen-out=logs")
    assert code == 1, output
    assert re.search(r"2 failed, 3 passed, 1 skipped, 1 xfailed", output)
    assert "Traceback" not in output
    assert re.search(r"^clearance: 0\.\d\d m < 2.00 m, at t = ", output, re.MULTILINE)
    assert re.search(r"^scenario  scenarios/bad.scenario.yaml:7$", output, re.MULTILINE)
    assert re.search(r"^again     simscen run scenarios/bad.scenario.yaml --seed 1$", output, re.MULTILINE)
    picture = re.search(r"^picture   (logs/\S+-pytest/runs/scenarios/bad/seed-1/map.png)$", output, re.MULTILINE)
    assert picture and (project / picture[1]).is_file()
    assert re.search(r"^FAILED scenarios/bad.scenario.yaml::bad - clearance: 0", output, re.MULTILINE)
    assert (
        "FAILED scenarios/held.scenario.yaml::held" in output
    )  # an expected failure that passes fails, as for `simscen run`
    cases = {case.get("name"): case for case in ElementTree.parse(project / "junit.xml").iter("testcase")}
    failure = cases["bad"].find("failure")
    assert failure is not None and str(failure.get("message")).startswith("clearance: 0.")
    assert cases["known"].find("skipped").get("message") == "too near to the wall"  # type: ignore[union-attr]
    assert {item.get("name") for item in cases["good"].iter("property")} >= {"seed", "log", "again"}


@pytest.mark.slow
def test_xdist_workers_share_one_output_folder_and_last_failed_is_known(run, project: Path) -> None:
    code, output = run("--simscen", "-n2", "scenarios", "-k", "good or bad")
    assert code == 1, output
    assert "1 failed, 1 passed" in output
    assert re.search(r"^clearance: 0\.\d\d m < 2.00 m, at t = ", output, re.MULTILINE)
    assert len(list((project / "simscen-out").iterdir())) == 1
    _, output = run("--simscen", "-p", "no:xdist", "scenarios", "--lf", "--collect-only", "-q")
    assert collected_items(output) == ["scenarios/bad.scenario.yaml::bad"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ini", "arguments", "message"),
    [
        ("", ("--simscen-stack", "nothing"), "cannot read --stack nothing"),
        pytest.param("simscen_seed = seven", (), "simscen_seed: 'seven' is not a whole", marks=pytest.mark.slow),
    ],
)
def test_invalid_stack_and_seed_are_usage_errors(run, project: Path, ini: str, arguments, message: str) -> None:
    (project / "pytest.ini").write_text(f"[pytest]\nsimscen_paths = scenarios\n{ini}\n")
    code, output = run("-p", "no:xdist", "scenarios/good.scenario.yaml", *arguments)
    assert code == 2 and message in output and "Traceback" not in output


@pytest.mark.sample(1)
@pytest.mark.parametrize("option", ["--simscen-seed", "--simscen-repeat"])
def test_seed_and_number_of_seeds_are_at_least_1(run, option: str) -> None:
    code, output = run("-p", "no:xdist", "scenarios/good.scenario.yaml", option, "0")
    assert code == pytest.ExitCode.USAGE_ERROR
    assert f"argument {option}: '0' is not a whole number of at least 1" in output


def test_fixture_runs_scenarios_with_the_configured_world_path_and_reports_the_reason_of_a_failure(
    run, project: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    worlds = tmp_path_factory.mktemp("worlds")
    (worlds / "room.world.yaml").write_text("simscen: 1\nwalls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]\n")
    inline = ROOM.splitlines()[2]
    (project / "scenarios/good.scenario.yaml").write_text(ROOM.replace(inline, "world: room.world.yaml"))
    (project / "pytest.ini").write_text(f"[pytest]\nsimscen_world_path = {worlds}\n")
    (project / "test_own.py").write_text(TEST)
    code, output = run("-p", "no:xdist", "test_own.py")
    assert code == 1, output
    assert "1 failed, 1 passed" in output
    assert re.search(r"<Run of scenarios/bad, seed 1: failed; clearance 0\.\d\d m \(≥ 2.00 m\)>.passed", output)
