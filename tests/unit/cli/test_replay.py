"""Tests of `simscen replay`, and of the replay pages of failed runs."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from simscen.cli.session.logs import log_name
from simscen.core.environment.scenery import Scenery
from simscen.record.log_header import LogHeader
from simscen.record.log_reader import read_run

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 3, y: 2}}]
pass: [CRITERION]
"""
GOOD, BAD = (SCENARIO.replace("CRITERION", text) for text in ("goals_reached: {}", "speed: {max: 0.2 m/s}"))


@pytest.fixture(scope="module")
def out(simscen_in, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the output folder of a session with a passed and a failed run."""
    home = tmp_path_factory.mktemp("home")
    (home / "good.scenario.yaml").write_text(GOOD)
    (home / "bad.scenario.yaml").write_text(BAD)
    result = simscen_in(home, "run", ".", "-j1", "--out", "out")
    assert result.code == 1, result.err
    assert "replay    out/runs/bad/seed-1/replay.html" in result.out
    return home / "out"


def test_failed_run_has_a_replay_that_all_reports_link(out: Path) -> None:
    assert [path.parent.parent.name for path in out.rglob("replay.html")] == ["bad"]
    results = json.loads((out / "results.json").read_text())
    pages = {run["scenario"]: run["artifacts"].get("replay") for run in results["runs"]}
    assert pages == {"bad": "runs/bad/seed-1/replay.html", "good": None}
    assert "[[ATTACHMENT|out/runs/bad/seed-1/replay.html]]" in (out / "junit.xml").read_text()


def test_replay_of_a_failed_run_equals_the_replay_of_the_command(simscen, out: Path, tmp_path: Path) -> None:
    run = out / "runs" / "bad" / "seed-1"
    result = simscen("replay", str(run), "--out", "page.html")
    assert (result.code, result.out) == (0, "page.html\n")
    assert (tmp_path / "page.html").read_bytes() == (run / "replay.html").read_bytes()


def test_log_with_damaged_scenery_is_an_error(simscen, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def damaged(header: LogHeader) -> Scenery:
        raise ValueError("not a scenery")

    monkeypatch.setattr("simscen.report.replay.page.scenery_from_header", damaged)
    result = simscen("replay", str(out / "runs" / "bad" / "seed-1"), "--out", "page.html")
    assert result.code == 2
    assert "error[SC802] the log is damaged: not a scenery" in result.err


def test_every_log_in_a_folder_gets_a_replay(simscen, out: Path) -> None:
    page = out / "runs" / "good" / "seed-1" / "replay.html"
    result = simscen("replay", str(out))
    assert result.code == 0 and result.out.splitlines() == [str(page).replace("good", name) for name in ("bad", "good")]
    assert page.is_file()
    page.unlink()


def test_bag_is_named_after_its_whole_folder(tmp_path: Path) -> None:
    (tmp_path / "drive.2").mkdir()
    assert [log_name(tmp_path / name) for name in ("drive.2", "drive.mcap")] == ["drive.2", "drive"]


def test_two_runs_are_shown_side_by_side(simscen, out: Path, tmp_path: Path) -> None:
    passed_run, failed_run = (str(out / "runs" / name / "seed-1") for name in ("good", "bad"))
    assert simscen("replay", passed_run, "--against", failed_run, "--out", "both.html").code == 0
    assert "<title>good, seed 1, passed against bad, seed 1, failed</title>" in (tmp_path / "both.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "code", "expected_text"),
    [
        (("nowhere",), 2, "nowhere:0:0: error[SC800]"),
        (("good.scenario.yaml",), 2, "SC801"),
        ((".",), 5, "no logs found"),
    ],
)
def test_invalid_log_is_an_error(simscen, arguments: tuple[str, ...], code: int, expected_text: str) -> None:
    result = simscen("replay", *arguments)
    assert result.code == code and expected_text.replace(":0:0", "") in result.err


def test_one_page_for_several_runs_is_rejected(simscen, out: Path) -> None:
    result = simscen("replay", str(out), "--out", "page.html")
    assert result.code == 2 and "--out takes one run, but 2 were found" in result.err


def test_log_is_not_overwritten(simscen, out: Path) -> None:
    log = out / "runs" / "bad" / "seed-1" / "run.mcap"
    original = log.read_bytes()
    assert simscen("replay", str(log), "--out", str(log)).code == 2
    assert log.read_bytes() == original


def test_replay_needs_no_engine(out: Path, tmp_path: Path) -> None:
    heavy = {"pybullet", "ompl", "scipy", "filterpy", "PIL", "trimesh", "embreex"}
    probe = (
        "import atexit, sys\nfrom simscen.cli.main import main\n"
        f"sys.argv = ['simscen', 'replay', {str(out / 'runs/bad/seed-1')!r}, '--out', {str(tmp_path / 'x.html')!r}]\n"
        f"atexit.register(lambda: print('imported:', *set(sys.modules) & {heavy!r}))\nmain()\n"
    )
    result = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert result.stdout.splitlines()[-1] == "imported:"


def test_log_contains_both_costmaps_at_a_limited_rate(out: Path) -> None:
    log = read_run(out / "runs" / "bad" / "seed-1" / "run.mcap", with_sensors=True)
    assert sorted(log.sensors.costmaps) == ["/global_costmap/costmap", "/local_costmap/costmap"]
    for topic, period in (("/global_costmap/costmap", 480), ("/local_costmap/costmap", 240)):
        messages = log.sensors.costmaps[topic]
        assert (np.diff([tick for tick, _ in messages]) >= period).all()
        frame, grid = log.sensors.decode_costmap(messages[-1][1])
        assert frame == ("map" if topic.startswith("/global") else "odom")
        assert set(np.unique(grid.cells).tolist()) <= {-1, *range(101)}
    _, wide = log.sensors.decode_costmap(log.sensors.costmaps["/global_costmap/costmap"][-1][1])
    assert log.header.map is not None and wide.shape == log.header.map.shape
    assert (wide.cells[log.header.map.cells == 100] == 100).all() and 99 in wide.cells
