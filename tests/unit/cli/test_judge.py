"""`simscen judge` on simscen's own logs: one, a folder of them, by their own criteria or by those of a file."""

import json
import shutil
import sys
from pathlib import Path

import pytest

from simscen.cli.main import main

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{name: "1e3", pose: {x: 1.5, y: 1}}]
time_limit: 20 s
"""
GOOD = SCENARIO + "pass:\n  - goals_reached: {}\n"
BAD = SCENARIO + "pass:\n  - speed: {max: 0.05 m/s}\n"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output folder of a run that passed and one that failed."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "good.scenario.yaml").write_text(GOOD)
    (folder / "bad.scenario.yaml").write_text(BAD)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(sys, "argv", ["simscen", "run", ".", "--out", "out"])
        with pytest.raises(SystemExit) as end:
            main()
    assert end.value.code == 1
    return folder / "out"


@pytest.fixture
def out(recorded: Path, tmp_path: Path) -> Path:
    """A copy of it in the working folder."""
    return Path(shutil.copytree(recorded, tmp_path / "out"))


def _log(out: Path, name: str) -> Path:
    (found,) = out.rglob(f"{name}/seed-1/run.mcap")
    return found


def test_a_run_folder_is_judged_as_its_log(simscen, out: Path) -> None:
    by_log, by_folder = (simscen("judge", str(path)) for path in (_log(out, "bad"), _log(out, "bad").parent))
    assert by_log == by_folder
    assert by_log.code == 1
    assert "speed: " in by_log.out and "> 0.05 m/s" in by_log.out


def test_an_output_folder_is_judged_log_by_log_in_a_line_each(simscen, out: Path) -> None:
    ended = simscen("judge", "out")
    bad, good, total = ended.out.splitlines()
    assert ended.code == 1
    assert bad.startswith(f"  ✗ {_log(out, 'bad').relative_to(out.parent)} ") and "speed: " in bad
    assert good.startswith(f"  ✓ {_log(out, 'good').relative_to(out.parent)} ") and good.endswith(" s recorded")
    assert total == "1 passed, 1 failed"
    assert len(json.loads(simscen("judge", "out", "--json").out)["runs"]) == 2


def test_a_file_with_nothing_but_criteria_is_enough_and_gives_a_table_of_margins(simscen, out: Path) -> None:
    (out.parent / "limits.yaml").write_text("pass:\n  - speed: {max: 9 m/s}\n  - collisions: {max: 2}\n")
    ended = simscen("judge", "out", "--scenario", "limits.yaml")
    head, bad, good, total = ended.out.splitlines()
    assert (ended.code, total) == (0, "2 passed")
    assert head.split() == ["log", "speed", "collisions"]
    assert [row.split()[0] for row in (bad, good)] == ["✓", "✓"]
    assert all(row.split()[2].startswith("+8.") and row.split()[-1] == "+2" for row in (bad, good))


def test_a_log_whose_goal_is_called_like_a_number_is_judged_again(simscen, out: Path) -> None:
    assert simscen("judge", str(_log(out, "good"))).code == 0


def test_criteria_may_extend_others_and_take_defaults(simscen, out: Path) -> None:
    (out.parent / "base.yaml").write_text("# limits of the site\npass:\n  - speed: {max: 0.05 m/s}\n")
    (out.parent / "site.scenario.yaml").write_text("extends: base.yaml\ntags: [site]\n")
    ended = simscen("judge", str(_log(out, "good")), "--scenario", "site.scenario.yaml")
    assert ended.code == 1
    assert "site.scenario.yaml:3" not in ended.out, "that line is one of base.yaml"
    (out.parent / "sub").mkdir()
    (out.parent / "sub/only.scenario.yaml").write_text("name: only\n")
    (out.parent / "sub/defaults.yaml").write_text("pass:\n  - speed: {max: 9 m/s}\n")
    assert simscen("judge", str(_log(out, "good")), "--scenario", "sub/only.scenario.yaml").code == 0


def test_mistakes_in_criteria_are_told_at_their_line_and_in_their_file(simscen, out: Path) -> None:
    (out.parent / "base.yaml").write_text("# limits\npass:\n  - speeed: {max: 1}\n")
    (out.parent / "site.yaml").write_text("\n\nextends: base.yaml\n")
    ended = simscen("judge", str(_log(out, "good")), "--scenario", "site.yaml")
    assert ended.code == 2
    assert ended.err.startswith("base.yaml:3:5: error[SC012] unknown key `speeed`")
    (out.parent / "empty.yaml").write_text("name: nothing\n")
    assert "missing key `pass`" in simscen("judge", str(_log(out, "good")), "--scenario", "empty.yaml").err


def test_the_line_of_a_violated_criterion_is_that_of_the_file_it_was_judged_by(simscen, out: Path) -> None:
    (out.parent / "limits.yaml").write_text("# site\n\npass:\n  - collisions: {max: 0}\n  - speed: {max: 0.05 m/s}\n")
    ended = simscen("judge", str(_log(out, "good")), "--scenario", "limits.yaml")
    assert "limits.yaml:5" in ended.out


def test_a_log_of_several_that_cannot_be_used_is_an_error_of_its_own(simscen, out: Path) -> None:
    _log(out, "bad").write_bytes(_log(out, "bad").read_bytes()[:3000])
    ended = simscen("judge", "out")
    assert ended.code == 3
    assert "1 passed, 0 failed" not in ended.out
    assert ended.out.splitlines()[-1] == "1 passed, 1 could not be judged"
    assert simscen("judge", str(_log(out, "bad"))).code == 2


def test_a_run_that_left_no_log_is_missed(simscen, out: Path) -> None:
    _log(out, "bad").unlink()
    ended = simscen("judge", "out")
    assert ended.code == 3
    assert "it left no log" in ended.out


def test_a_folder_without_logs_is_not_success(simscen, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    ended = simscen("judge", "empty")
    assert ended.code == 5
    assert "no logs found in `empty`" in ended.err
    assert simscen("judge", "nowhere").code == 2
