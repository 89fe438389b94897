"""`simscen localize`: logs written by a run, and by hand, of a drive in a room with a crate."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

BOXES = np.array([
    (-0.1, -0.1, 6.1, 0.0), (-0.1, 4.0, 6.1, 4.1), (-0.1, 0.0, 0.0, 4.0), (6.0, 0.0, 6.1, 4.0), (1.2, 1.8, 2.0, 2.8),
    (4.5, 0.0, 5.2, 0.4),
])  # fmt: skip
ANGLES = -math.pi / 2 + math.pi / 180 * np.arange(181)


def ranges_at(x: float, y: float, yaw: float) -> list[float]:
    """Exact ranges by the slab method."""
    with np.errstate(divide="ignore"):
        inverse = 1 / np.column_stack((np.cos(yaw + ANGLES), np.sin(yaw + ANGLES)))
    found = np.full(len(ANGLES), 20.0)
    for left, low, right, high in BOXES:
        near, far = ((np.array(corner) - (x, y)) * inverse for corner in ((left, low), (right, high)))
        enter, leave = np.minimum(near, far).max(axis=1), np.maximum(near, far).min(axis=1)
        found = np.where((enter <= leave) & (enter > 0), np.minimum(found, enter), found)
    return found.round(3).tolist()


def write_map(folder: Path) -> None:
    """The room at 5 cm."""
    centre = 0.025 + 0.05 * np.arange(128) - 0.2
    x, y = np.meshgrid(centre, centre[:88])
    solid = sum((x + 0.02 > b[0]) & (x - 0.02 < b[2]) & (y + 0.02 > b[1]) & (y - 0.02 < b[3]) for b in BOXES)
    pixels = np.where(np.asarray(solid) > 0, 0, 254).astype(np.uint8)[::-1]
    (folder / "room.pgm").write_bytes(b"P5 128 88 255\n" + pixels.tobytes())
    numbers = "resolution: 0.05\norigin: [-0.2, -0.2, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    (folder / "room.yaml").write_text("image: room.pgm\n" + numbers)


def drive() -> list[tuple[float, tuple[float, float, float], tuple[float, float, float]]]:
    """Time, true pose and odometry whose wheels slip by a tenth, past the crate at 0.3 m/s and 10 Hz."""
    rows, x, y, yaw, odom = [], 1.0, 0.8, 0.0, [0.0, 0.0, 0.0]
    for k in range(150):
        rows.append((k / 10, (x, y, yaw), (odom[0], odom[1], odom[2])))
        turn = 0.05 if 50 <= k < 81 else 0.0
        x, y = x + 0.03 * math.cos(yaw + turn / 2), y + 0.03 * math.sin(yaw + turn / 2)
        odom[0] += 0.033 * math.cos(odom[2] + turn / 2)
        odom[1] += 0.033 * math.sin(odom[2] + turn / 2)
        yaw, odom[2] = yaw + turn, odom[2] + turn
    return rows


def write_csv(folder: Path, pose_rows: bool = True) -> None:
    """Rows of odometry, scans and truth."""
    lines = ["# a drive"]
    for t, true, odom in drive():
        lines.append("odom," + ",".join(map(str, (t, *odom))))
        lines.append("scan," + ",".join(map(str, (t, -math.pi / 2, math.pi / 180, 0.05, 15, *ranges_at(*true)))))
        if pose_rows:
            lines.append("truth," + ",".join(map(str, (t, *true))))
    (folder / "drive.csv").write_text("\n".join(lines) + "\n")


def write_carmen(folder: Path, kind: str) -> None:
    """FLASER lines, or ROBOTLASER1 lines, with TRUEPOS."""
    lines = ["# CARMEN Logfile"]
    for t, true, odom in drive():
        ranges, place = " ".join(map(str, ranges_at(*true))), " ".join(map(str, odom))
        tail = f"{t} host {t}"
        if kind == "FLASER":
            lines.append(f"FLASER 181 {ranges} {place} {place} {tail}")
        else:
            head = f"ROBOTLASER1 0 {-math.pi / 2} {math.pi} {math.pi / 180} 15 0.01 0 181"
            lines.append(f"{head} {ranges} 0 {place} {place} 0 0 0.3 0.3 0 {tail}")
        lines.append(f"TRUEPOS {' '.join(map(str, true))} {place} {tail}")
    (folder / "drive.log").write_text("\n".join(lines) + "\n")


GIVEN = ("--map", "room.yaml", "--robot", "turtlebot")


@pytest.mark.parametrize("kind", ["csv", "FLASER", "ROBOTLASER1"])
def test_a_drive_on_slipping_wheels_is_followed_in_every_format(simscen, tmp_path: Path, kind: str) -> None:
    write_map(tmp_path)
    write_csv(tmp_path) if kind == "csv" else write_carmen(tmp_path, kind)
    log = "drive.csv" if kind == "csv" else "drive.log"
    ended = simscen("localize", log, *GIVEN, "--json", "--picture", "way.png")
    assert ended.code == 0, ended.err
    found = json.loads(ended.out)
    assert found["scans"] == 150
    assert found["error"]["max"] < 0.2
    assert found["error"]["rmse"] < 0.1
    assert found["lost"] == []
    assert "ms of processor time per scan" in ended.err
    assert (tmp_path / "way.png").stat().st_size > 1000
    assert simscen("localize", log, *GIVEN, "--json").out == ended.out


def test_odometry_alone_drifts_off_and_that_is_told(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    write_csv(tmp_path)
    Path("stack.yaml").write_text("stack: {localizer: {type: odometry}}\npass: [{goals_reached: {}}]\n")
    ended = simscen("localize", "drive.csv", *GIVEN, "--scenario", "stack.yaml", "--lost", "0.2", "--json")
    assert ended.code == 0, ended.err
    found = json.loads(ended.out)
    times = np.array([t for t, *_ in drive()])
    true, odom = (np.array([row[k][:2] for row in drive()]) for k in (1, 2))
    off = np.hypot(*(odom + np.array((1.0, 0.8)) - true).T)
    assert [row[0] for row in found["error_over_time"]] == pytest.approx(times)
    assert [row[1] for row in found["error_over_time"]] == pytest.approx(off, abs=1e-9)
    assert found["error"]["rmse"] == pytest.approx(np.sqrt(np.mean(off**2)))
    assert found["lost"][0]["since"] == pytest.approx(times[off > 0.2][0])


def test_without_a_reference_one_says_where_to_begin(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    write_csv(tmp_path, pose_rows=False)
    assert simscen("localize", "drive.csv", *GIVEN).code == 2
    ended = simscen("localize", "drive.csv", *GIVEN, "--start", "1,0.8,0")
    assert ended.code == 0
    assert "no reference to compare with" in ended.out


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("bad.csv", "odom,0,1,2\n", "line 1: expected 3 numbers"),
        ("bad.csv", "odometry,0,1,2,3\n", "no kind of row"),
        ("bad.csv", "odom,0,1,2,3\n", "it holds no scans"),
        ("bad.log", "FLASER 3 1.0 2.0\n", "line 1 is not a FLASER line"),
        ("bad.log", "ODOM 1 2 nan 0 0 0 1 host 1\n", "nan is not a number"),
        ("bad.mcap", "what", "not an MCAP file"),
    ],
)
def test_a_log_that_cannot_be_used_is_told_in_words(simscen, tmp_path: Path, name: str, text: str, told: str) -> None:
    write_map(tmp_path)
    Path(name).write_text(text)
    ended = simscen("localize", name, *GIVEN)
    assert ended.code == 2
    assert told in ended.err
    assert "Traceback" not in ended.err


def test_the_log_of_a_run_gives_the_figures_of_its_verdict(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    Path("room.scenario.yaml").write_text(
        "simscen: 1\nworld: room.yaml\nrobot: {pose: {x: 1, y: 0.8}}\ngoals: [{pose: {x: 5, y: 3}}]\n"
        "pass: [{localization_error: {max: 2 m, rmse: 2 m, final: 2 m}}]\n"
    )
    assert simscen("run", "room.scenario.yaml", "--out", "out", "--seed", "3").code == 0
    log = next(Path("out").rglob("run.mcap"))
    (run,) = json.loads((tmp_path / "out" / "results.json").read_text())["runs"]
    (verdict,) = run["verdicts"]
    ended = simscen("localize", str(log), *GIVEN, "--seed", "3", "--json")
    assert ended.code == 0, ended.err
    error = json.loads(ended.out)["error"]
    judged = {one["what"].removeprefix("localization_error").strip(): one["value"] for one in verdict["findings"]}
    assert error["max"] == pytest.approx(judged[""], abs=0.005)
    assert error["rmse"] == pytest.approx(judged["rmse"], abs=0.005)
    assert error["final"] == pytest.approx(judged["final"], abs=0.02)
