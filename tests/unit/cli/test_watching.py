"""Which scenarios `--watch` runs when a file is saved."""

import io
import json
from pathlib import Path

import pytest

from simscen.cli.session.watch import WatchReporter, WatchState, file_stamps
from simscen.core.errors import Exit, Problem


@pytest.fixture
def files(tmp_path: Path):
    """Two scenarios in a folder, and a watch that has heard of their sessions: b did not pass."""
    for name in ("a", "b"):
        (tmp_path / f"{name}.scenario.yaml").write_text("")
    return tmp_path


@pytest.fixture
def watching(files: Path) -> WatchState:
    found = WatchState(lambda: sorted(files.glob("*.scenario.yaml")), [files])
    found.begin([files])
    for name, others in (("a", ["room", "robot"]), ("b", ["robot"])):
        scenario = str(files / f"{name}.scenario.yaml")
        made_of = [scenario, *(str(files / f"{other}.yaml") for other in others)]
        found.update(json.dumps({"scenario": scenario, "files": made_of}))
        found.update(json.dumps({"scenario": scenario, "good": name == "a"}))
    found.end(Exit.FAILED)
    return found


def names(paths) -> str:
    return " ".join(path.name.partition(".")[0] for path in paths)


@pytest.mark.parametrize(
    ("saved", "told"), [("room.yaml", "a"), ("robot.yaml", "a b"), ("b.scenario.yaml", "b"), ("notes.txt", "")]
)
def test_what_a_file_is_part_of_runs_again(watching: WatchState, files: Path, saved: str, told: str) -> None:
    assert names(watching.scenarios_to_run({files / saved})) == told


def test_a_new_scenario_runs_and_a_removed_one_is_forgotten(watching: WatchState, files: Path) -> None:
    (files / "new.scenario.yaml").write_text("")
    (files / "b.scenario.yaml").unlink()
    assert names(watching.scenarios_to_run({files})) == "new"
    assert names(watching.scenarios) == "a new"
    assert watching.failed == []


def test_what_did_not_pass_is_known_until_it_runs_again(watching: WatchState, files: Path) -> None:
    assert names(watching.failed) == "b"
    watching.begin([files / "b.scenario.yaml"])
    assert watching.failed == []


def test_a_session_that_a_mistake_kept_from_running_is_tried_again_with_what_was_touched(
    watching: WatchState, files: Path
) -> None:
    watching.begin([files / "b.scenario.yaml"])
    report = io.StringIO()
    WatchReporter(report).invalid_files([Problem(str(files / "world.yaml"), 1, 1, "SC012", "unknown key")])
    watching.update(report.getvalue())
    watching.end(Exit.USAGE)
    assert files / "world.yaml" in watching.files
    assert names(watching.scenarios_to_run({files / "world.yaml"})) == "b"
    assert names(watching.scenarios_to_run({files / "room.yaml"})) == "a b"


def test_a_file_that_is_saved_has_another_stamp_also_when_it_comes_or_goes(files: Path) -> None:
    file = files / "a.scenario.yaml"
    stamps = [file_stamps([file])]
    (files / "part").write_text("another")
    (files / "part").rename(file)
    stamps.append(file_stamps([file]))
    file.unlink()
    stamps.append(file_stamps([file]))
    assert stamps[0] != stamps[1] != stamps[2] == {file: None}
