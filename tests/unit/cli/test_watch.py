"""Scenarios that `--watch` runs after changes of files."""

import io
import json
from pathlib import Path

import pytest

from simscen.cli.session.watch import WatchReporter, WatchState, file_stamps
from simscen.core.errors import Exit, Problem


@pytest.fixture
def files(tmp_path: Path):
    """Return a folder with two scenarios, of which b failed."""
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
    ("saved", "names_to_run"), [("room.yaml", "a"), ("robot.yaml", "a b"), ("b.scenario.yaml", "b"), ("notes.txt", "")]
)
def test_scenarios_that_use_a_changed_file_run_again(
    watching: WatchState, files: Path, saved: str, names_to_run: str
) -> None:
    assert names(watching.scenarios_to_run({files / saved})) == names_to_run


def test_new_scenario_runs_and_removed_one_is_dropped(watching: WatchState, files: Path) -> None:
    (files / "new.scenario.yaml").write_text("")
    (files / "b.scenario.yaml").unlink()
    assert names(watching.scenarios_to_run({files})) == "new"
    assert names(watching.scenarios) == "a new"
    assert watching.failed == []


def test_failed_scenarios_are_known_until_they_run_again(watching: WatchState, files: Path) -> None:
    assert names(watching.failed) == "b"
    watching.begin([files / "b.scenario.yaml"])
    assert watching.failed == []


def test_session_with_an_invalid_file_is_repeated_after_a_change(watching: WatchState, files: Path) -> None:
    watching.begin([files / "b.scenario.yaml"])
    report = io.StringIO()
    WatchReporter(report).write_invalid_files([Problem(str(files / "world.yaml"), 1, 1, "SC012", "unknown key")])
    watching.update(report.getvalue())
    watching.end(Exit.USAGE)
    assert files / "world.yaml" in watching.files
    assert names(watching.scenarios_to_run({files / "world.yaml"})) == "b"
    assert names(watching.scenarios_to_run({files / "room.yaml"})) == "a b"


def test_stamp_changes_when_a_file_is_saved_created_or_deleted(files: Path) -> None:
    file = files / "a.scenario.yaml"
    stamps = [file_stamps([file])]
    (files / "part").write_text("another")
    (files / "part").rename(file)
    stamps.append(file_stamps([file]))
    file.unlink()
    stamps.append(file_stamps([file]))
    assert stamps[0] != stamps[1] != stamps[2] == {file: None}


def test_new_subfolders_are_watched_except_output_folders(watching: WatchState, files: Path) -> None:
    (files / "new" / "deep").mkdir(parents=True)
    (files / ".hidden").mkdir()
    (files / "out" / "runs").mkdir(parents=True)
    (files / "out" / "events.jsonl").write_text("")
    watching.scenarios_to_run({files})
    folders = {path.relative_to(files).as_posix() for path in watching.files if path.is_dir()}
    assert folders == {".", "new", "new/deep"}
