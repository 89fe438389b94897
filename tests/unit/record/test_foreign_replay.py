"""Tests of replay pages for logs of real robots."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from foreign_logs import BEGIN, Message, T, drive, header, link, stamped_pose, write_bag, write_mcap

from simscen.cli.main import main
from simscen.cli.session.judging import LogJudge
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.read import read_foreign_log


class Completed(NamedTuple):
    """Exit code and output of a command."""

    code: int
    out: str
    err: str


@pytest.fixture
def simscen(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Completed]:
    """Return a function that runs `simscen ARGUMENTS`."""

    def call(*arguments: str) -> Completed:
        monkeypatch.setattr(sys, "argv", ["simscen", *arguments])
        code = 0
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
        return Completed(code, *capsys.readouterr())

    return call


def map_message() -> Message:
    info = T["nav_msgs/msg/MapMetaData"](
        map_load_time=header(BEGIN, "").stamp,
        resolution=0.1,
        width=4,
        height=3,
        origin=T["geometry_msgs/msg/Pose"](
            position=T["geometry_msgs/msg/Point"](x=-1.0, y=-2.0, z=0.0),
            orientation=T["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        ),
    )
    cells = np.array([0, 100, -1] * 4, dtype=np.int8)
    return Message("/map", BEGIN, T["nav_msgs/msg/OccupancyGrid"](header=header(BEGIN, "map"), info=info, data=cells))


def mount_message(topic: str = "/tf_static") -> Message:
    return Message(topic, BEGIN, link(BEGIN, "base_link", "laser", 0.2))


@pytest.mark.parametrize(("write", "topic"), [(write_mcap, "/tf_static"), (write_bag, "/tf")])
def test_scans_map_and_lidar_mounts_are_read(tmp_path: Path, write: Callable[..., object], topic: str) -> None:
    write(tmp_path / "log.mcap", [map_message(), mount_message(topic), *drive(2.0)])
    read = read_foreign_log(tmp_path / "log.mcap", ForeignLogOptions("/mocap"), with_sensors=True)
    assert read.map is not None and read.map.shape == (3, 4) and read.map.origin[:2] == (-1.0, -2.0)
    (messages,) = read.sensors.scans.values()
    assert [tick for tick, _ in messages] == sorted(tick for tick, _ in messages) and len(messages) == 5
    assert read.sensors.mounts["laser"].x == pytest.approx(0.2)


def test_local_plans_with_an_invalid_orientation_are_ignored(tmp_path: Path) -> None:
    plans = []
    for number, w in enumerate((1.0, 0.0)):
        pose = stamped_pose(BEGIN, "map", 1.0)
        pose.pose.orientation = T["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=w)
        path = T["nav_msgs/msg/Path"](header=header(BEGIN, "map"), poses=[pose])
        plans.append(Message("/local_plan", BEGIN + number, path))
    write_mcap(tmp_path / "log.mcap", [*plans, *drive(2.0)])
    read = read_foreign_log(tmp_path / "log.mcap", ForeignLogOptions("/mocap"), with_sensors=True)
    assert len(read.sensors.local_plans) == 1


def test_scan_of_a_lidar_that_is_upside_down_is_mirrored(tmp_path: Path) -> None:
    turned = link(BEGIN, "base_link", "lidar", 0.2)
    turned.transforms[0].transform.rotation = T["geometry_msgs/msg/Quaternion"](x=1.0, y=0.0, z=0.0, w=0.0)
    log = [Message("/tf_static", BEGIN, turned), *drive(2.0)]
    for message in log:
        if message.topic == "/scan":
            message.message.ranges = np.where(np.arange(8) == 0, 1.0, np.inf).astype(np.float32)
    write_mcap(tmp_path / "log.mcap", log)
    read = read_foreign_log(tmp_path / "log.mcap", ForeignLogOptions("/mocap"), with_sensors=True)
    ((_, data), *_) = read.sensors.scans["/scan"]
    (hit,) = read.sensors.decode_scan(data).points()
    # The only beam with a hit points at -1 rad in the frame of the lidar, which is on the left of the robot.
    assert hit == pytest.approx([0.2 + np.cos(1.0), np.sin(1.0)], abs=1e-6)


def test_a_lidar_can_have_an_infinite_maximum_range(simscen, tmp_path: Path) -> None:
    """This is the default of pointcloud_to_laserscan."""
    log = drive(2.0)
    for message in log:
        if message.topic == "/scan":
            message.message.range_max = np.inf
    write_mcap(tmp_path / "log.mcap", log)
    completed = simscen("replay", str(tmp_path / "log.mcap"), "--truth", "/mocap")
    assert (completed.code, completed.err) == (0, "")


def test_replay_page_is_written_with_and_without_criteria(simscen, tmp_path: Path) -> None:
    log = tmp_path / "monday.mcap"
    write_mcap(log, [map_message(), mount_message(), *drive(2.0)])
    completed = simscen("replay", str(log), "--truth", "/mocap")
    page = tmp_path / "monday.replay.html"
    assert (completed.code, completed.out) == (0, f"{page}\n")
    assert "<title>monday, seed 0, skipped</title>" in page.read_text()
    (tmp_path / "limits.yaml").write_text("simscen: 1\npass: [{localization_error: {max: 0.01 m}}]\n")
    completed = simscen("replay", str(log), "--truth", "/mocap", "--scenario", str(tmp_path / "limits.yaml"))
    assert completed.code == 0 and "<title>monday, seed 0, failed</title>" in page.read_text()


@pytest.mark.parametrize(("kept_fraction", "is_complete"), [(1.0, True), (0.6, False)])
def test_replay_of_a_truncated_log_is_marked_as_truncated(
    tmp_path: Path, kept_fraction: float, is_complete: bool
) -> None:
    log = tmp_path / "monday.mcap"
    write_mcap(log, [map_message(), mount_message(), *drive(20.0)], chunk_size=10_000)
    log.write_bytes(log.read_bytes()[: int(kept_fraction * log.stat().st_size)])
    recorded_run, _ = LogJudge(ForeignLogOptions("/mocap"), None, None, ()).judge_for_replay(log)
    assert recorded_run.complete == is_complete
