"""Output files overwrite only regular files and never inputs."""

import errno
import os
from pathlib import Path

import pytest

from simscen.cli.session.output_files import Reports
from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import SessionEvent
from simscen.report.journal import Journal
from simscen.run.sessions.output_folder import create_output_folder, run_folder, write_atomically

NOT_REGULAR = ("device", "fifo", "link", "dangling", "folder")


@pytest.fixture
def special_file(tmp_path: Path):
    """Return a function that creates a path that is not a regular file; its kind is one of NOT_REGULAR."""

    def create(kind: str) -> Path:
        path = tmp_path / f"special-{kind}.png"
        match kind:
            case "device":
                return Path("/dev/null")
            case "fifo":
                os.mkfifo(path)
            case "link":
                (tmp_path / "precious").write_text("keep me")
                path.symlink_to("precious")
            case "dangling":
                path.symlink_to("nowhere")
            case "folder":
                path.mkdir()
        return path

    return create


@pytest.mark.parametrize("name", ["...scenario.yaml", "..scenario.yaml", ".scenario.yaml"])
@pytest.mark.parametrize("command", ["run", "validate"])
def test_file_name_without_a_valid_id_is_rejected(simscen, tmp_path: Path, name, command) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "good.scenario.yaml").rename(tmp_path / "in" / name)
    result = simscen(command, f"in/{name}")
    assert result.code == 2
    assert f"in/{name}: error[SC041] its id would end in" in result.out + result.err
    assert not list(tmp_path.rglob("*.mcap"))


@pytest.mark.parametrize("scenario", ["junit.xml", "results.json/x", "run.json", "events.jsonl", "runs"])
def test_run_folders_do_not_collide_with_reports(scenario: str) -> None:
    assert run_folder(Path("out"), RunKey(scenario, 3)) == Path("out/runs") / scenario / "seed-3"


@pytest.mark.parametrize("kind", NOT_REGULAR)
@pytest.mark.parametrize(
    "command",
    [
        ("run", "good.scenario.yaml", "--out", "out", "--junit"),
        ("world", "inspect", "room.world.yaml", "--png"),
        ("world", "export", "room.world.yaml", "--map"),
        ("world", "convert", "room.world.yaml"),
    ],
)
def test_only_regular_files_are_overwritten(simscen, tmp_path: Path, special_file, kind, command) -> None:
    (tmp_path / "room.world.yaml").write_text(
        "{simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}"
    )
    path = special_file(kind)
    original_state = path.lstat()
    result = simscen(*command, str(path))
    assert result.code == 2
    assert result.err.startswith(f"simscen: cannot write {path}: ")
    assert path.lstat().st_mode == original_state.st_mode
    assert kind != "link" or (tmp_path / "precious").read_text() == "keep me"
    assert not list(tmp_path.rglob("*.mcap"))


def test_schemas_are_not_written_through_symbolic_links(simscen, tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("keep me")
    (tmp_path / "schemas").mkdir()
    (tmp_path / "schemas/scenario.schema.json").symlink_to("../precious")
    result = simscen("schema", "--write", "schemas")
    assert (result.code, result.err) == (
        2, "simscen: cannot write schemas/scenario.schema.json: it is a symbolic link; name the file itself\n"
    )  # fmt: skip
    assert (tmp_path / "precious").read_text() == "keep me"


def test_unwritable_schema_folder_is_an_error(simscen) -> None:
    result = simscen("schema", "--write", "good.scenario.yaml")
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith("simscen: cannot write good.scenario.yaml/scenario.schema.json: ")


def test_inputs_are_not_overwritten(simscen, tmp_path: Path) -> None:
    world = "{simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}"
    (tmp_path / "room.world.yaml").write_text(world)
    (tmp_path / "defaults.yaml").write_text("tags: [nightly]\n")
    scenario = (tmp_path / "good.scenario.yaml").read_text()
    for command in (
        ("run", "good.scenario.yaml", "--junit", "good.scenario.yaml"),
        ("run", "good.scenario.yaml", "--junit", "defaults.yaml"),
        ("world", "inspect", "room.world.yaml", "--png", "room.world.yaml"),
        ("world", "convert", "room.world.yaml", "room.world.yaml"),
    ):
        result = simscen(*command)
        assert result.code == 2
        assert result.err.endswith("it is one of the input files\n")
    assert (tmp_path / "room.world.yaml").read_text() == world
    assert (tmp_path / "good.scenario.yaml").read_text() == scenario


def test_junit_can_be_in_a_subfolder_of_a_new_output_folder(simscen, tmp_path: Path) -> None:
    assert simscen("run", "good.scenario.yaml", "--out", "out", "--junit", "out/ci/report.xml").code == 0
    assert (tmp_path / "out/ci/report.xml").read_bytes() == (tmp_path / "out/junit.xml").read_bytes()


@pytest.mark.parametrize("name", ["results.json", "events.jsonl", "run.json", "report.html", "runs/good/junit.xml"])
@pytest.mark.parametrize("folder_exists", [False, True])
def test_junit_cannot_use_reserved_names(simscen, tmp_path: Path, name, folder_exists) -> None:
    options = ("--out", "new") if folder_exists else ("--out", "out")
    if folder_exists:
        (tmp_path / "out").mkdir()
        (tmp_path / "out/events.jsonl").write_text("{}\n")
    result = simscen("run", "good.scenario.yaml", *options, "--junit", f"out/{name}")
    assert result.code == 2
    assert result.err == f"simscen: cannot write out/{name}: simscen writes another file with this name there\n"


@pytest.mark.parametrize("name", [".", "..", "", "deep/", "deep/.", ".scenario.yaml"])
def test_new_rejects_names_that_run_rejects(simscen, tmp_path: Path, name) -> None:
    result = simscen("new", name)
    assert result.code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["good.scenario.yaml"]


def test_user_file_named_latest_is_kept(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("simscen-out").mkdir()
    Path("simscen-out/latest").write_text("keep me")
    folder = create_output_folder(None)
    assert Path("simscen-out/latest").read_text() == "keep me"
    assert set(Path("simscen-out").iterdir()) == {folder, Path("simscen-out/latest")}


def test_only_regular_files_are_replaced_atomically(special_file) -> None:
    for kind in NOT_REGULAR:
        with pytest.raises(OSError, match=r"not a regular file|symbolic link|directory"):
            write_atomically(special_file(kind), b"")


def test_unwritten_report_is_not_named(tmp_path: Path, monkeypatch) -> None:
    def write(path: Path, data: bytes) -> None:
        if path.name != "results.json":
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("simscen.cli.session.output_files.write_atomically", write)
    reports = Reports(tmp_path, None, "simscen")
    assert not reports.write([])
    result = reports.finished_event([], 1.0, False)
    assert (result.junit, result.page) == ("", "")


def test_incomplete_journal_of_a_study_is_reported(simscen, monkeypatch) -> None:
    def lose(journal: Journal, _: SessionEvent) -> None:
        journal.error = OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Journal, "__call__", lose)
    result = simscen("study", "good.scenario.yaml", "--runs", "1", "--out", "out", "-j", "1")
    assert result.code == 3
    assert "simscen: the journal in out is incomplete: No space left on device\n" in result.err
