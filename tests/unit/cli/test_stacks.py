"""Tests of `--stack`: each selected scenario runs with each given stack."""

import json
import shlex
from pathlib import Path
from xml.etree import ElementTree

import pytest

from simscen import simulate
from simscen.core.errors import InvalidInput, UsageError
from simscen.record.log_reader import read_log

SHORT = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""
DWB = "simscen: 1\nstack: {controller: {type: dwb}}\n"
IDLE = '''
from simscen.core.geometry.kinematics import STOP
from simscen.core.records.trace import Decision
from simscen.model.stack import InProcessStack

class Idle(InProcessStack):
    """Does nothing."""
    component = "idle:IdleStack"

class IdleStack:
    plan = goal = None
    def __init__(self, spec, setting): pass
    def start(self, estimate, goals): pass
    def preempt(self, tick, goal): pass
    cancel = preempt
    def decide(self, tick, readings): return Decision(STOP)
'''
BOTH = ("--stack", "ref=reference", "--stack", "dwb=dwb.stack.yaml")


@pytest.fixture
def project(simscen, tmp_path: Path) -> Path:
    """Return a folder with two scenarios of one second and a stack file."""
    (tmp_path / "good.scenario.yaml").unlink()
    for name in ("a", "b"):
        (tmp_path / f"{name}.scenario.yaml").write_text(SHORT)
    (tmp_path / "dwb.stack.yaml").write_text(DWB)
    return tmp_path


def run_folders(folder: Path) -> list[str]:
    """Return the run folders that contain a log."""
    return sorted(str(log.parent.relative_to(folder / "runs")) for log in folder.rglob("run.mcap"))


def test_every_scenario_runs_with_every_stack_and_seed(simscen, project: Path) -> None:
    result = simscen("run", ".", *BOTH, "--repeat", "2", "--out", "out")
    assert result.code == 0, result.err
    names = [f"{name}/seed-{seed}-{stack}" for name in "ab" for seed in (1, 2) for stack in ("dwb", "ref")]
    assert run_folders(project / "out") == names
    cases = [case.get("name") for case in ElementTree.parse(project / "out/junit.xml").iter("testcase")]
    assert sorted(cases) == sorted(f"{n} [seed {s}, {k}]" for n in "ab" for s in (1, 2) for k in ("ref", "dwb"))
    recorded_runs = json.loads((project / "out/results.json").read_text())["runs"]
    assert {(run["stack_name"], run["stack"]) for run in recorded_runs} == {
        ("ref", "ref=reference"),
        ("dwb", "dwb=dwb.stack.yaml"),
    }
    texts = {stack: (project / f"out/runs/a/seed-1-{stack}/scenario.yaml").read_text() for stack in ("ref", "dwb")}
    assert texts["ref"] == SHORT
    assert "type: dwb" in texts["dwb"]


@pytest.mark.slow
def test_report_from_the_journal_has_the_same_comparison(simscen, project: Path) -> None:
    assert simscen("run", ".", *BOTH, "--repeat", "2", "--out", "out").code == 0
    originals = {name: (project / "out" / name).read_bytes() for name in ("results.json", "junit.xml", "report.html")}
    assert b'"comparison"' in originals["results.json"]
    data = (project / "out/events.jsonl").read_bytes()
    (project / "copy").mkdir()
    (project / "copy/events.jsonl").write_bytes(data)
    result = simscen("report", "copy")
    assert "dwb against ref: 4 pairs" in result.out
    assert (
        json.loads((project / "copy/results.json").read_text())["comparison"]
        == json.loads(originals["results.json"])["comparison"]
    )


@pytest.mark.slow
def test_single_stack_has_no_label(simscen, project: Path) -> None:
    assert simscen("run", "a.scenario.yaml", "--out", "plain").code == 0
    result = simscen("run", "a.scenario.yaml", "--stack", "mine=reference", "--out", "mine", "--check-against", "plain")
    assert result.code == 0, result.out
    assert run_folders(project / "mine") == ["a/seed-1"]
    other = simscen("run", "a.scenario.yaml", "--stack", "d=dwb.stack.yaml", "--out", "d", "--check-against", "plain")
    assert other.code == 3
    assert "nondeterministic" in other.out


@pytest.mark.slow
def test_repeat_command_includes_the_stack(simscen, project: Path) -> None:
    simscen("run", "a.scenario.yaml", *BOTH, "--seed", "7", "--out", "out")
    recorded_runs = json.loads((project / "out/results.json").read_text())["runs"]
    repeat_command = next(run["again"] for run in recorded_runs if run["stack_name"] == "dwb")
    assert repeat_command == "simscen run a.scenario.yaml --seed 7 --stack dwb=dwb.stack.yaml"
    assert simscen(*shlex.split(repeat_command)[1:], "--out", "again").code == 0
    text = (project / "again/runs/a/seed-7/scenario.yaml").read_text()
    assert text == (project / "out/runs/a/seed-7-dwb/scenario.yaml").read_text()


@pytest.mark.slow
def test_repeated_run_equals_the_run_with_several_stacks(simscen, project: Path) -> None:
    """The repeat command has one stack, which needs no label."""
    assert simscen("run", "a.scenario.yaml", *BOTH, "--out", "out").code == 0
    result = simscen("run", "a.scenario.yaml", "--stack", "dwb=dwb.stack.yaml", "--check-against", "out")
    assert result.code == 0, result.out


def test_log_contains_the_name_of_its_stack(simscen, project: Path) -> None:
    assert simscen("run", "a.scenario.yaml", *BOTH, "--out", "out").code == 0
    judged = json.loads(simscen("judge", "out", "--json").out)
    assert sorted(run["stack_name"] for run in judged["runs"]) == ["dwb", "ref"]
    facts = read_log(project / "out/runs/a/seed-1-dwb/run.mcap").header.facts
    assert facts["stack"] == "dwb=dwb.stack.yaml"


def test_python_interface_accepts_stacks(project: Path) -> None:
    run = simulate("a.scenario.yaml", stack="dwb=dwb.stack.yaml")
    assert run.passed
    assert run.result.again == "simscen run a.scenario.yaml --seed 1 --stack dwb=dwb.stack.yaml"
    with pytest.raises(UsageError, match="expected NAME=VALUE"):
        simulate("a.scenario.yaml", stack="a b=reference")
    (project / "a.scenario.yaml").write_text(SHORT + "stack: {external: mine}\n")
    with pytest.raises(InvalidInput, match="the external stack `mine` has no command"):
        simulate("a.scenario.yaml")
    assert simulate("a.scenario.yaml", stack="dwb=dwb.stack.yaml").passed


def test_installed_stack_type_is_a_valid_stack(packages, simscen, project: Path) -> None:
    packages("idle", "1.0", {"stack": {"idle": "idle:Idle"}}, idle=IDLE)
    result = simscen("run", "a.scenario.yaml", "--stack", "i=idle", "--stack", "ref=reference", "--out", "out")
    assert result.code == 0, result.out + result.err
    assert "type: idle" in (project / "out/runs/a/seed-1-i/scenario.yaml").read_text()
    assert simscen("validate", "a.scenario.yaml", "--stack", "idle").code == 0
    assert "did you mean `idle`" in simscen("validate", ".", "--stack", "idl").err


@pytest.mark.slow
def test_determinism_is_checked_for_each_stack(simscen, project: Path) -> None:
    result = simscen("run", "a.scenario.yaml", *BOTH, "--check-determinism", "--out", "out")
    assert result.code == 0, result.out
    assert run_folders(project / "out") == [f"a/seed-1-{stack}" for stack in ("dwb", "dwb.again", "ref", "ref.again")]


@pytest.mark.slow
def test_resume_repeats_runs_of_a_changed_stack_file_only(simscen, project: Path) -> None:
    def call(*options: str) -> None:
        assert simscen("run", "a.scenario.yaml", *BOTH, *options).code == 0

    call("--out", "out")
    logs = {stack: (project / f"out/runs/a/seed-1-{stack}/run.mcap") for stack in ("ref", "dwb")}
    first_times = {stack: log.stat().st_mtime_ns for stack, log in logs.items()}
    call("--resume", "out")
    assert {stack: log.stat().st_mtime_ns for stack, log in logs.items()} == first_times
    (project / "dwb.stack.yaml").write_text(DWB.replace("dwb", "mppi"))
    call("--resume", "out")
    second_times = {stack: log.stat().st_mtime_ns for stack, log in logs.items()}
    assert second_times["ref"] == first_times["ref"]
    assert second_times["dwb"] > first_times["dwb"]


JUMP = "faults: [{sensor: localizer, jump: {y: 0.5 m}, for: 0.2 s}]\n"


@pytest.mark.slow
def test_scenario_of_a_folder_that_the_stack_cannot_run_is_skipped(simscen, project: Path) -> None:
    scenario = (project / "a.scenario.yaml").read_text()
    (project / "jump.scenario.yaml").write_text(scenario + JUMP)
    reason = "--stack mine cannot run it: jump.scenario.yaml:7:19: only the localizer of simscen's own stacks"
    result = simscen("run", ".", "--stack", "reference", "--stack", "mine=/bin/true", "--out", "out", "-k", "jump")
    assert f"jump (mine)      skipped: {reason}" in result.out
    assert "1 passed, 1 skipped" in result.out
    assert "nothing to compare" in result.out
    outcomes = [run["outcome"] for run in json.loads((project / "out/results.json").read_text())["runs"]]
    assert sorted(outcomes) == ["passed", "skipped"]
    assert f'<skipped type="simscen.skip" message="{reason}' in (project / "out/junit.xml").read_text()
    single = simscen("run", ".", "--stack", "mine=/bin/true", "-k", "jump")
    assert (single.code, "0 passed, 1 skipped" in single.out) == (5, True)


def test_named_scenario_that_the_stack_cannot_run_is_invalid(simscen, project: Path) -> None:
    (project / "jump.scenario.yaml").write_text((project / "a.scenario.yaml").read_text() + JUMP)
    result = simscen("run", ".", "jump.scenario.yaml", "--stack", "mine=/bin/true")
    assert result.code == 2
    assert "jump.scenario.yaml:7:19: error[SC062]" in result.err


def test_scenario_with_other_errors_is_not_skipped(simscen, project: Path) -> None:
    wrong = (
        (project / "a.scenario.yaml").read_text()
        + JUMP
        + "events: [{name: x, when: {time: 1 s}, do: {open: {name: d}}}]\n"
    )
    (project / "jump.scenario.yaml").write_text(wrong)
    result = simscen("run", ".", "--stack", "mine=/bin/true")
    assert result.code == 2
    assert "error[SC030]" in result.err


@pytest.mark.slow
def test_keywords_and_shards_keep_pairs_together(simscen, project: Path) -> None:
    assert simscen("run", ".", *BOTH, "--shard", "2/2", "--out", "shard").code == 0
    assert run_folders(project / "shard") == ["b/seed-1-dwb", "b/seed-1-ref"]
    assert simscen("run", ".", *BOTH, "-k", "a", "--out", "word").code == 0
    assert run_folders(project / "word") == ["a/seed-1-dwb", "a/seed-1-ref"]
    assert simscen("run", ".", *BOTH, "-k", "dwb", "--out", "none").code == 5


@pytest.mark.parametrize(
    ("stack_options", "expected_text"),
    [
        (("refrence",), "cannot read --stack refrence: expected NAME=VALUE"),
        (("a b=reference",), "cannot read --stack a b=reference: expected NAME=VALUE"),
        (("../x=reference",), "expected NAME=VALUE"),
        (("=reference",), "expected NAME=VALUE"),
        (("again=reference",), "the name `again` is reserved"),
        (("a=reference", "A=reference"), "--stack A=reference: the name is already used"),
        (("a=nowhere.stack.yaml",), "nowhere.stack.yaml: error[SC001] no such file or directory"),
        (("a=bad.stack.yaml",), "bad.stack.yaml:2:9: error[SC012] unknown key `controler` in `stack`"),
    ],
)
def test_invalid_stack_is_reported_before_any_run(simscen, project: Path, stack_options, expected_text: str) -> None:
    (project / "bad.stack.yaml").write_text("simscen: 1\nstack: {controler: {}}\n")
    result = simscen("run", ".", *(word for text in stack_options for word in ("--stack", text)))
    assert result.code == 2
    assert expected_text in result.err
    assert not (project / "simscen-out").exists()


def test_stack_files_are_validated(simscen, project: Path) -> None:
    (project / "bad.stack.yaml").write_text("simscen: 1\nstack: {controler: {}}\n")
    result = simscen("validate", ".")
    assert result.code == 2
    assert "bad.stack.yaml:2:9: error[SC012]" in result.out
    (project / "bad.stack.yaml").unlink()
    assert simscen("validate", ".").out == "2 scenarios and 1 stack are valid\n"


def test_schema_of_stack_files_is_written(simscen, project: Path) -> None:
    schema = json.loads(simscen("schema", "stack").out)
    assert schema["title"] == "simscen stack"
    assert "keepout" not in schema["$defs"]["StackSpec"]["properties"]
