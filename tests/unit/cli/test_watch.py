"""Tests of `--watch`: the scenarios that run after files have changed."""

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
def watch_state(files: Path) -> WatchState:
    """Return the state after a session in which scenario a passed and scenario b failed."""
    state = WatchState(lambda: sorted(files.glob("*.scenario.yaml")), [files])
    state.begin([files])
    for name, other_files in (("a", ["room", "robot"]), ("b", ["robot"])):
        scenario = str(files / f"{name}.scenario.yaml")
        files_of_scenario = [scenario, *(str(files / f"{file}.yaml") for file in other_files)]
        state.update(json.dumps({"scenario": scenario, "files": files_of_scenario}))
        state.update(json.dumps({"scenario": scenario, "good": name == "a"}))
    state.end(Exit.FAILED)
    return state


def names(paths) -> str:
    """Return the names of files without their extensions, separated by spaces."""
    return " ".join(path.name.partition(".")[0] for path in paths)


@pytest.mark.parametrize(
    ("saved", "names_to_run"), [("room.yaml", "a"), ("robot.yaml", "a b"), ("b.scenario.yaml", "b"), ("notes.txt", "")]
)
def test_scenarios_that_use_a_changed_file_run_again(
    watch_state: WatchState, files: Path, saved: str, names_to_run: str
) -> None:
    assert names(watch_state.scenarios_to_run({files / saved})) == names_to_run


def test_new_scenario_runs_and_removed_one_is_dropped(watch_state: WatchState, files: Path) -> None:
    (files / "new.scenario.yaml").write_text("")
    (files / "b.scenario.yaml").unlink()
    assert names(watch_state.scenarios_to_run({files})) == "new"
    assert names(watch_state.scenarios) == "a new"
    assert watch_state.failed == []


def test_scenario_counts_as_failed_until_it_runs_again(watch_state: WatchState, files: Path) -> None:
    assert names(watch_state.failed) == "b"
    watch_state.begin([files / "b.scenario.yaml"])
    assert watch_state.failed == []


def test_session_with_an_invalid_file_is_repeated_after_a_change(watch_state: WatchState, files: Path) -> None:
    watch_state.begin([files / "b.scenario.yaml"])
    report = io.StringIO()
    WatchReporter(report).write_invalid_files([Problem(str(files / "world.yaml"), 1, 1, "SC012", "unknown key")])
    watch_state.update(report.getvalue())
    watch_state.end(Exit.USAGE)
    assert files / "world.yaml" in watch_state.files
    assert names(watch_state.scenarios_to_run({files / "world.yaml"})) == "b"
    assert names(watch_state.scenarios_to_run({files / "room.yaml"})) == "a b"


def test_stamp_changes_when_a_file_is_saved_created_or_deleted(files: Path) -> None:
    file = files / "a.scenario.yaml"
    stamps = [file_stamps([file])]
    (files / "part").write_text("another")
    (files / "part").rename(file)
    stamps.append(file_stamps([file]))
    file.unlink()
    stamps.append(file_stamps([file]))
    assert stamps[0] != stamps[1] != stamps[2] == {file: None}


def test_new_subfolders_are_watched_except_output_folders(watch_state: WatchState, files: Path) -> None:
    (files / "new" / "deep").mkdir(parents=True)
    (files / ".hidden").mkdir()
    (files / "out" / "runs").mkdir(parents=True)
    (files / "out" / "events.jsonl").write_text("")
    watch_state.scenarios_to_run({files})
    folders = {path.relative_to(files).as_posix() for path in watch_state.files if path.is_dir()}
    assert folders == {".", "new", "new/deep"}
