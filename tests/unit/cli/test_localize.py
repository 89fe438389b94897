"""Tests of `simscen localize` on recorded and handwritten logs of a drive past a crate."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.record.localization_logs.read import read_localization_log

sys.path.insert(0, str(Path(__file__).parent))
from recorded_drives import drive, ranges_at, write_carmen, write_csv, write_map

OPTIONS = ("--map", "room.yaml", "--robot", "turtlebot")


@pytest.mark.parametrize("kind", ["csv", "FLASER", "ROBOTLASER1"])
def test_drive_with_slipping_wheels_is_localized_in_every_format(simscen, tmp_path: Path, kind: str) -> None:
    write_map(tmp_path)
    write_csv(tmp_path) if kind == "csv" else write_carmen(tmp_path, kind)
    log = "drive.csv" if kind == "csv" else "drive.log"
    result = simscen("localize", log, *OPTIONS, "--json", "--picture", "path.png")
    assert result.code == 0, result.err
    output = json.loads(result.out)
    assert output["scans"] == 150
    assert output["error"]["max"] < 0.2
    assert output["error"]["rmse"] < 0.1
    assert output["lost"] == []
    assert "ms of CPU time per scan" in result.err
    assert (tmp_path / "path.png").stat().st_size > 1000
    assert simscen("localize", log, *OPTIONS, "--json").out == result.out


def test_picture_does_not_overwrite_the_map(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    write_csv(tmp_path)
    (image,) = tmp_path.glob("room.p*")
    original = image.read_bytes()
    assert simscen("localize", "drive.csv", *OPTIONS, "--picture", image.name).code == 2
    assert image.read_bytes() == original


def test_drift_of_odometry_is_reported(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    write_csv(tmp_path)
    Path("stack.yaml").write_text("stack: {localizer: {type: odometry}}\npass: [{goals_reached: {}}]\n")
    result = simscen("localize", "drive.csv", *OPTIONS, "--scenario", "stack.yaml", "--lost", "0.2", "--json")
    assert result.code == 0, result.err
    output = json.loads(result.out)
    times = np.array([t for t, *_ in drive()])
    true, odom = (np.array([row[k][:2] for row in drive()]) for k in (1, 2))
    errors = np.hypot(*(odom + np.array((1.0, 0.8)) - true).T)
    assert [row[0] for row in output["error_over_time"]] == pytest.approx(times)
    assert [row[1] for row in output["error_over_time"]] == pytest.approx(errors, abs=1e-9)
    assert output["error"]["rmse"] == pytest.approx(np.sqrt(np.mean(errors**2)))
    assert output["lost"][0]["since"] == pytest.approx(times[errors > 0.2][0])


@pytest.mark.parametrize(("first_odometry", "first_reference"), [(0.0, 10.0), (4.0, 0.0), (4.0, 10.0), (4.1, 0.0)])
def test_default_start_is_the_pose_at_the_start_of_the_odometry(
    tmp_path: Path, first_odometry: float, first_reference: float
) -> None:
    lines = []
    for t, (x, y, yaw), _ in drive():
        odometry = Pose2(3.0, -1.0, 2.5).compose(Pose2(x, y, yaw))
        lines += [f"odom,{t},{odometry.x},{odometry.y},{odometry.yaw}"] if t >= first_odometry else []
        lines += [f"truth,{t},{x},{y},{yaw}"] if t >= first_reference and round(10 * t) % 2 == 0 else []
    (tmp_path / "drive.csv").write_text("\n".join([*lines, "scan,12,-1,0.1,0.05,15,1.0,1.0"]))
    start = read_localization_log(tmp_path / "drive.csv", "/odom", "/scan", None).initial_pose
    expected_pose = next(pose for t, pose, _ in drive() if t >= first_odometry)
    assert start == pytest.approx(expected_pose, abs=1e-9)


def test_log_without_reference_needs_a_start(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    write_csv(tmp_path, pose_rows=False)
    assert simscen("localize", "drive.csv", *OPTIONS).code == 2
    result = simscen("localize", "drive.csv", *OPTIONS, "--start", "1,0.8,0")
    assert result.code == 0
    assert "no reference to compare with" in result.out


@pytest.mark.parametrize(
    ("name", "text", "expected_text"),
    [
        ("bad.csv", "odom,0,1,2\n", "line 1: expected 3 numbers"),
        ("bad.csv", "odometry,0,1,2,3\n", "unknown kind of row"),
        ("bad.csv", "odom,0,1,2,3,,\n", "it has no scans"),
        ("bad.csv", "\ufeffodom,0,1,2,3\r\n", "it has no scans"),
        ("bad.log", "\ufeffODOM 1 2 3 0 0 0 0 a 0\r\n", "it has no scans"),
        ("bad.csv", "scan,0,-1,0.1,0.1,9,1.0,,2.0\n", "line 1: could not convert string to float: ''"),
        ("bad.log", "FLASER 3 1.0 2.0\n", "line 1 is not a FLASER line"),
        ("bad.log", "ODOM 1 2 nan 0 0 0 1 host 1\n", "invalid coordinates 1, 2, nan"),
        ("bad.mcap", "what", "not an MCAP file"),
    ],
)
def test_unusable_log_is_reported(simscen, tmp_path: Path, name: str, text: str, expected_text: str) -> None:
    write_map(tmp_path)
    Path(name).write_text(text)
    result = simscen("localize", name, *OPTIONS)
    assert result.code == 2
    assert expected_text in result.err
    assert "Traceback" not in result.err


def verdict_error(out: Path) -> dict[str, float]:
    """Return the localization errors of the only verdict of a session."""
    (run,) = json.loads((out / "results.json").read_text())["runs"]
    (verdict,) = run["verdicts"]
    return {
        finding["what"].removeprefix("localization_error").strip() or "max": finding["value"]
        for finding in verdict["findings"]
    }


PASS = "pass: [{localization_error: {max: 20 m, rmse: 20 m, final: 20 m}}]\n"
ROOM = "simscen: 1\nworld: {simscen: 1, map: room.yaml, objects: [%s]}\nrobot: {pose: {x: 1, y: 0.8}}\n"
WALKERS = ", ".join(
    f"{{name: walker {k}, cylinder: [0.2, 1.7], pose: {{x: {x}, y: {low}}}, "
    f"move: {{through: [[{x}, {high}], [{x}, {low}]], speed: 0.6 m/s, repeat: loop}}}}"
    for k, (x, low, high) in enumerate([(2.6, 2.4, 3.6), (3.6, 2.2, 3.5), (0.6, 2.0, 3.4)])
)
SLIPPING = ROOM % WALKERS + (
    "goals: [{pose: {x: 5.2, y: 1.2}, timeout: 60 s}, {pose: {x: 5, y: 3}, timeout: 60 s}]\n"
    "faults: [{sensor: odom, slip: {left: 30 %, right: 15 %}, when: {travelled: 1 m}, for: 5 s}]\n"
)
RECOVERY = """\
stack:
  localizer:
    {laser_model_type: likelihood_field, max_particles: 5000, recovery_alpha_slow: 0.001, recovery_alpha_fast: 0.1}
"""


@pytest.mark.slow
@pytest.mark.parametrize("stack", ["", RECOVERY], ids=["no recovery", "recovery"])
def test_log_of_a_run_gives_the_errors_of_its_verdict(simscen, tmp_path: Path, stack: str) -> None:
    write_map(tmp_path)
    Path("room.scenario.yaml").write_text(SLIPPING + stack + PASS)
    assert simscen("run", "room.scenario.yaml", "--out", "out", "--seed", "3").code == 0
    log, verdict_errors = next(Path("out").rglob("run.mcap")), verdict_error(tmp_path / "out")
    result = simscen("localize", str(log), *OPTIONS, "--scenario", "room.scenario.yaml", "--seed", "3", "--json")
    assert result.code == 0, result.err
    output = json.loads(result.out)
    # A log has ranges in single precision, so that the particles differ after a while.
    for name, tolerance in (("max", 0.03), ("rmse", 0.01), ("final", 0.03)):
        assert output["error"][name] == pytest.approx(verdict_errors[name], abs=tolerance)
    assert verdict_errors["max"] < 0.5
    assert output["lost"] == []


SCAN_MATCHING = "stack: {localizer: {type: scan_matching_amcl}}\n"


@pytest.mark.slow
def test_kidnapped_robot_is_lost_with_plain_amcl_and_found_by_relocalization(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    lines = [f"{word},{t / 10},{value}" for t, word, value in kidnapped_drive()]
    Path("drive.csv").write_text("\n".join(lines) + "\n")
    for name, recovery in (("plain", ""), ("scan_matching", SCAN_MATCHING), ("recovery", RECOVERY)):
        Path(f"{name}.yaml").write_text(recovery + "pass: [{goals_reached: {}}]\n")
        result = simscen("localize", "drive.csv", *OPTIONS, "--scenario", f"{name}.yaml", "--json")
        assert result.code == 0, result.err
        output = json.loads(result.out)
        assert output["lost"][0]["since"] == pytest.approx(5.0, abs=0.11)
        assert (output["error"]["final"] < 0.3) == (name != "plain")
        assert (output["lost"][-1]["until"] is None) == (name == "plain")


def kidnapped_drive() -> list[tuple[int, str, str]]:
    """Return the drive with a kidnapping after 5 s to near its end, and 40 s of turning left and right there."""
    rows, odom = [], [0.0, 0.0, 0.0]
    pose = (1.0, 0.8, 0.0)
    for k in range(450):
        step, turn = (0.03, 0.0) if k < 50 else (0.02 * (-1) ** (k // 40), 0.08 * math.cos(k / 15))
        if k == 50:
            pose = (4.6, 3.2, -2.0)
        numbers = (-math.pi / 2, math.pi / 180, 0.05, 15, *ranges_at(*pose))
        rows += [(k, "odom", ",".join(map(str, odom))), (k, "truth", ",".join(map(str, pose)))]
        rows.append((k, "scan", ",".join(map(str, numbers))))
        x, y, yaw = pose
        pose = (x + step * math.cos(yaw + turn / 2), y + step * math.sin(yaw + turn / 2), yaw + turn)
        odom[0] += step * math.cos(odom[2] + turn / 2)
        odom[1] += step * math.sin(odom[2] + turn / 2)
        odom[2] += turn
    return rows


@pytest.mark.parametrize("width", [80, 200])
def test_output_of_localize_fits_the_terminal(
    simscen, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    write_map(tmp_path)
    write_csv(tmp_path)
    result = simscen("localize", "drive.csv", *OPTIONS)
    assert max(map(len, result.out.splitlines())) <= width
    assert "never lost (more than 1 m off)" in result.out
