"""Tests of `simscen judge` on logs of simscen, with the recorded criteria and with a criteria file."""

import errno
import json
import os
import shutil
from pathlib import Path

import pytest

from simscen.cli.session import logs
from simscen.core.records.run_result import RunKey, RunResult
from simscen.judge.run_result import judge_run

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
  obstacles: [{name: post, box: [0.1, 0.1, 1], pose: {x: 5, y: 3}}]
robot: {pose: {x: 1, y: 1}}
goals: [{name: "1e3", pose: {x: 1.5, y: 1}}]
events:
  - name: late
    when: {time: 90 s}
    do: [{mark: {name: spot}}, {spawn: {name: crate, box: [0.1, 0.1, 0.1], pose: {x: 4, y: 3}}}]
    required: false
time_limit: 20 s
"""
GOOD = SCENARIO + "pass:\n  - goals_reached: {}\n"
BAD = SCENARIO + "pass:\n  - speed: {max: 0.05 m/s}\n"


@pytest.fixture(scope="module")
def recorded(simscen_in, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the output folder of a passed and a failed run."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "good.scenario.yaml").write_text(GOOD)
    (folder / "bad.scenario.yaml").write_text(BAD)
    assert simscen_in(folder, "run", ".", "--out", "out").code == 1
    return folder / "out"


@pytest.fixture
def out(recorded: Path, tmp_path: Path) -> Path:
    """Return a copy of the output folder in the working directory."""
    return Path(shutil.copytree(recorded, tmp_path / "out"))


def _log(out: Path, name: str) -> Path:
    (log,) = out.rglob(f"{name}/seed-1/run.mcap")
    return log


def test_run_folder_is_judged_as_its_log(simscen, out: Path) -> None:
    by_log, by_folder = (simscen("judge", str(path)) for path in (_log(out, "bad"), _log(out, "bad").parent))
    assert by_log == by_folder
    assert by_log.code == 1
    assert "speed: " in by_log.out and "> 0.05 m/s" in by_log.out


def test_internal_error_for_one_log_keeps_the_verdicts_of_the_others(
    simscen, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail_on_bad(key: RunKey, *arguments: object) -> RunResult:
        if key.scenario == "bad":
            raise AssertionError("a defect")
        return judge_run(key, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(logs, "judge_run", fail_on_bad)
    result = simscen("judge", "out")
    bad_line, good_line, summary = result.out.splitlines()
    assert result.code == 3
    assert "internal: AssertionError: a defect; judge this log alone for the traceback" in bad_line
    assert good_line.startswith("  ✓ ") and summary == "1 passed, 1 could not be judged"
    assert simscen("judge", str(_log(out, "bad"))).code == 4


def test_output_folder_gives_one_line_per_log(simscen, out: Path) -> None:
    result = simscen("judge", "out")
    bad_line, good_line, summary = result.out.splitlines()
    assert result.code == 1
    assert bad_line.startswith(f"  ✗ {_log(out, 'bad').relative_to(out.parent)} ") and "speed: " in bad_line
    assert good_line.startswith(f"  ✓ {_log(out, 'good').relative_to(out.parent)} ") and good_line.endswith(
        " s recorded"
    )
    assert summary == "1 passed, 1 failed"
    assert len(json.loads(simscen("judge", "out", "--json").out)["runs"]) == 2


def test_criteria_file_gives_a_table_of_margins(simscen, out: Path) -> None:
    (out.parent / "limits.yaml").write_text("pass:\n  - speed: {max: 9 m/s}\n  - collisions: {max: 2}\n")
    result = simscen("judge", "out", "--scenario", "limits.yaml")
    header, bad_line, good_line, summary = result.out.splitlines()
    assert (result.code, summary) == (0, "2 passed")
    assert header.split() == ["log", "speed", "collisions"]
    assert [row.split()[0] for row in (bad_line, good_line)] == ["✓", "✓"]
    assert all(row.split()[2].startswith("+8.") and row.split()[-1] == "+2" for row in (bad_line, good_line))


def test_log_with_a_goal_name_that_looks_like_a_number_is_judged(simscen, out: Path) -> None:
    assert simscen("judge", str(_log(out, "good"))).code == 0


def test_criteria_file_can_extend_and_use_defaults(simscen, out: Path) -> None:
    (out.parent / "base.yaml").write_text("# limits of the site\npass:\n  - speed: {max: 0.05 m/s}\n")
    (out.parent / "site.scenario.yaml").write_text("extends: base.yaml\ntags: [site]\n")
    result = simscen("judge", str(_log(out, "good")), "--scenario", "site.scenario.yaml")
    assert result.code == 1
    assert "site.scenario.yaml:3" not in result.out, "the line is in base.yaml"
    (out.parent / "sub").mkdir()
    (out.parent / "sub/only.scenario.yaml").write_text("name: only\n")
    (out.parent / "sub/defaults.yaml").write_text("pass:\n  - speed: {max: 9 m/s}\n")
    assert simscen("judge", str(_log(out, "good")), "--scenario", "sub/only.scenario.yaml").code == 0


def test_errors_in_criteria_have_file_and_line(simscen, out: Path) -> None:
    (out.parent / "base.yaml").write_text("# limits\npass:\n  - speeed: {max: 1}\n")
    (out.parent / "site.yaml").write_text("\n\nextends: base.yaml\n")
    result = simscen("judge", str(_log(out, "good")), "--scenario", "site.yaml")
    assert result.code == 2
    assert result.err.startswith("base.yaml:3:5: error[SC012] unknown key `speeed`")
    (out.parent / "empty.yaml").write_text("name: nothing\n")
    assert "missing key `pass`" in simscen("judge", str(_log(out, "good")), "--scenario", "empty.yaml").err


@pytest.mark.parametrize(
    ("condition", "is_known"),
    [
        ("event_active, event: late", True),
        ("event_active, event: spot", True),
        ("started, event: lat", False),
        ("fault_active, fault: slip", False),
        ("goal_active, goal: dock", False),
    ],
)
def test_criterion_with_a_name_unknown_to_the_scenario_of_the_log_is_inconclusive(
    simscen, out: Path, condition: str, is_known: bool
) -> None:
    (out.parent / "limits.yaml").write_text(f"pass: [{{always: {{not: {{signal: {condition}}}}}}}]\n")
    result = simscen("judge", str(_log(out, "good")), "--scenario", "limits.yaml")
    kind, _, name = condition.partition(", ")[2].partition(": ")
    assert (result.code == 0) is is_known
    assert (f"inconclusive: the scenario has no {kind} `{name}`" in result.out) is not is_known


@pytest.mark.parametrize(
    ("name", "world", "is_known"),
    [
        ("wall_1", "", True),
        ("post", "", True),
        ("crate", "", True),
        ("crat", "", False),
        ("shelf", "", False),
        ("shelf", "world: {simscen: 1, objects: [{name: shelf, box: [1, 1, 1], pose: {x: 3, y: 3}}]}", True),
    ],
)
def test_criterion_on_contacts_with_an_unknown_object_is_inconclusive(
    simscen, out: Path, name: str, world: str, is_known: bool
) -> None:
    criteria = f"[{{collisions: {{with: {name}}}}}, {{always: {{not: {{signal: in_collision, with: {name}}}}}}}]"
    (out.parent / "limits.yaml").write_text(f"{world}\npass: {criteria}\n")
    result = simscen("judge", str(_log(out, "good")), "--scenario", "limits.yaml")
    assert (result.code == 0) is is_known
    reason = f"inconclusive: neither the log nor the world of the criteria file has an object `{name}`"
    assert result.out.count(reason) == (0 if is_known else 2)


def test_violated_criterion_names_the_line_of_the_criteria_file(simscen, out: Path) -> None:
    (out.parent / "limits.yaml").write_text("# site\n\npass:\n  - collisions: {max: 0}\n  - speed: {max: 0.05 m/s}\n")
    result = simscen("judge", str(_log(out, "good")), "--scenario", "limits.yaml")
    assert "limits.yaml:5" in result.out


def test_unusable_log_among_several_is_an_error_result(simscen, out: Path) -> None:
    _log(out, "bad").write_bytes(_log(out, "bad").read_bytes()[:3000])
    result = simscen("judge", "out")
    assert result.code == 3
    assert "1 passed, 0 failed" not in result.out
    assert result.out.splitlines()[-1] == "1 passed, 1 could not be judged"
    assert simscen("judge", str(_log(out, "bad"))).code == 2


@pytest.mark.parametrize("folder", ["out", "."])
def test_run_without_log_is_reported(simscen, out: Path, folder: str) -> None:
    _log(out, "bad").unlink()
    result = simscen("judge", folder)
    assert result.code == 3
    assert "the run left no log" in result.out


def test_session_that_planned_no_runs_has_no_missing_logs(simscen, out: Path) -> None:
    (out.parent / "killed").mkdir()
    (out.parent / "killed/events.jsonl").touch()
    assert simscen("judge", ".", "--scenario", "good.scenario.yaml").code == 0


def test_unreadable_folder_is_an_error(simscen, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scandir = os.scandir

    def deny(path: str) -> object:
        if Path(path).name == "bad":
            raise PermissionError(errno.EACCES, "Permission denied", path)
        return scandir(path)

    monkeypatch.setattr(os, "scandir", deny)
    result = simscen("judge", "out")
    assert result.code == 2
    assert "out/runs/bad: error[SC800]" in result.err


def test_folder_without_logs_is_an_error(simscen, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    result = simscen("judge", "empty")
    assert result.code == 5
    assert "no logs found in `empty`" in result.err
    assert simscen("judge", "nowhere").code == 2
