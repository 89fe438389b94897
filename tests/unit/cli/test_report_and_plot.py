"""Tests of `simscen report` and `simscen plot` on a recorded run."""

import errno
import json
import os
import shutil
from pathlib import Path

import pytest
from PIL import Image

from simscen.report.journal import Journal

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
  doors: [{name: gate, points: [[0.2, 3], [0.2, 2]], closed: false}]
  places: {dock: {x: 5, y: 1}}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 9 s
pass: [{collisions: {max: 0}}, {goals_reached: {}}]
"""


@pytest.fixture(scope="module")
def recorded(simscen_in, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the output folder of a session with two failed runs."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "short.scenario.yaml").write_text(SCENARIO)
    assert simscen_in(folder, "run", "short.scenario.yaml", "--out", "out", "--repeat", "2").code == 1
    (folder / "short.scenario.yaml").unlink()  # reports print relative paths of existing files
    return folder / "out"


@pytest.fixture
def out(recorded: Path, tmp_path: Path) -> Path:
    """Return a copy of the output folder in the working directory."""
    return Path(shutil.copytree(recorded, tmp_path / "out"))


@pytest.mark.parametrize("name", ["results.json", "junit.xml"])
def test_reports_are_reproduced_byte_for_byte(simscen, out: Path, name: str) -> None:
    original = (out / name).read_bytes()
    (out / name).write_text("spoilt")
    result = simscen("report", "out")
    assert (result.code, result.err) == (1, "")
    assert (out / name).read_bytes() == original
    assert "2 failed" in result.out
    assert result.out.splitlines()[-1].startswith(
        "success 0% of 2 runs (0% … 66%) · SPL 0.00 of 2 values · 0.0 collisions/km"
    )


def test_reports_have_other_formats_and_paths(simscen, out: Path) -> None:
    result = simscen("report", "out", "--format", "json", "--junit", "ci/junit.xml", "--junit-family", "xunit2")
    assert json.loads(result.out) == json.loads((out / "results.json").read_text())
    assert b'line="' not in (out.parent / "ci/junit.xml").read_bytes()


def test_report_with_junit_writes_only_that_file(simscen, out: Path) -> None:
    originals = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in out.rglob("*") if path.is_file()}
    result = simscen("report", "out", "--junit", "ci.xml", "--junit-family", "xunit2")
    assert result.code == 1
    assert result.out.splitlines()[-2].endswith("· ci.xml")
    assert {
        path: (path.read_bytes(), path.stat().st_mtime_ns) for path in out.rglob("*") if path.is_file()
    } == originals
    assert b'line="' not in (out.parent / "ci.xml").read_bytes()


def test_paths_in_reports_are_relative_to_the_working_directory(
    simscen, out: Path, recorded: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (recorded.parent / "short.scenario.yaml").write_text(SCENARIO)
    (recorded.parent / "ci").mkdir()
    monkeypatch.chdir(recorded.parent / "ci")
    result = simscen("report", str(out), "--junit", "here.xml")
    assert result.code == 1
    assert b'file="../short.scenario.yaml"' in (recorded.parent / "ci/here.xml").read_bytes()
    (recorded.parent / "short.scenario.yaml").unlink()


def test_full_disk_keeps_existing_reports(simscen, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    originals = {path: path.read_bytes() for path in out.iterdir() if path.is_file()}

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    result = simscen("report", "out")
    assert result.code == 3
    assert "simscen: cannot write out/junit.xml: No space left on device\n" in result.err
    assert {path: path.read_bytes() for path in out.iterdir() if path.is_file()} == originals


def test_running_session_is_not_changed(simscen, out: Path) -> None:
    journal = Journal(out, resume=True)
    result = simscen("report", "out")
    journal.close()
    assert result.code == 2
    assert "is in use" in result.err


def test_folder_without_session_is_an_error(simscen, tmp_path: Path) -> None:
    result = simscen("report", ".")
    assert result.code == 2
    assert "the folder has no events.jsonl" in result.err


def test_run_is_drawn_from_its_log(simscen, out: Path, tmp_path: Path) -> None:
    log = out / "runs/short/seed-1/run.mcap"
    shutil.move(log, tmp_path / "partial.mcap")
    shutil.rmtree(out)
    result = simscen("plot", "partial.mcap", "--out", "partial.png")
    assert result == (0, "partial.png\n", "")
    with Image.open(tmp_path / "partial.png") as picture:
        assert picture.format == "PNG"
        assert picture.width > 600


def test_picture_equals_that_of_the_run(simscen, out: Path) -> None:
    original = (out / "runs/short/seed-1/map.png").read_bytes()
    (out / "runs/short/seed-1/map.png").unlink()
    assert simscen("plot", "out/runs/short/seed-1").code == 0
    assert (out / "runs/short/seed-1/map.png").read_bytes() == original


def test_partial_log_is_drawn(simscen, out: Path) -> None:
    folder = out / "runs/short/seed-1"
    data = (folder / "run.mcap").read_bytes()
    (folder / "run.mcap").unlink()
    (folder / "map.png").unlink()
    (folder / "run.partial.mcap").write_bytes(data[: len(data) * 3 // 4])
    assert simscen("plot", "out/runs/short/seed-1").code == 0
    assert (folder / "map.png").exists()


@pytest.mark.parametrize(
    ("arguments", "expected_text"),
    [
        (("nowhere",), "nowhere: error[SC800] cannot read the log: No such file or directory"),
        (("out",), "out: error[SC800] there is no run.mcap in it"),
        (("good.scenario.yaml",), "error[SC801] not a log of simscen"),
        (("out/runs/short/seed-1", "--out", "good.scenario.yaml/x.png"), "cannot write good.scenario.yaml/x.png"),
    ],
)
def test_unusable_log_cannot_be_drawn(simscen, out: Path, arguments, expected_text) -> None:
    result = simscen("plot", *arguments)
    assert result.code == 2
    assert expected_text in result.err
