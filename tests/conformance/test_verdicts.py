"""Conformance tests of verdicts: a criterion never passes without evidence in the log."""

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

from simscen import simulate

sys.path.insert(0, str(Path(__file__).parents[1] / "unit/cli"))
from recorded_drives import write_csv, write_map

ROOM = "world: room.world.yaml\nrobot: {model: cube.robot.yaml, pose: {x: 1, y: 1}}\n"
SPEED_MPS = 0.5

STORE = get_typestore(Stores.ROS2_HUMBLE)
T: dict[str, Any] = STORE.types

Keep = Callable[[str, float], bool]


@pytest.fixture(scope="module")
def passed_log(tmp_path_factory: pytest.TempPathFactory, texts: dict[str, str]) -> Path:
    """Record a run that passes all its criteria, and return its log."""
    home = tmp_path_factory.mktemp("passed")
    criteria = "pass: [{goals_reached: {}}, {collisions: {max: 0}}, {clearance: {min: 0.1}}, {speed: {max: 1}}]"
    for name, text in texts.items():
        (home / name).write_text(text.replace("pass: [{goals_reached: {}}]", criteria))
    run = simulate(home / "a.scenario.yaml", log=home / "run.mcap")
    assert run.passed and run.log is not None
    return run.log


def rewrite(log: Path, target: Path, keep: Keep, backwards: bool) -> Path:
    """Copy a log with the messages to keep, selected by topic and by seconds since the first message."""
    with log.open("rb") as source, target.open("wb") as sink:
        reader, writer = make_reader(source), Writer(sink)
        writer.start("ros2", "a log editor")
        messages = list(reader.iter_messages(log_time_order=False))
        start = messages[0][2].log_time
        channels: dict[str, int] = {}
        for schema, channel, message in messages[::-1] if backwards else messages:
            if not keep(channel.topic, (message.log_time - start) / 1e9):
                continue
            if channel.topic not in channels:
                assert schema is not None
                registered = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", registered)
            writer.add_message(channels[channel.topic], message.log_time, message.data, message.log_time)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for attachment in reader.iter_attachments():
            writer.add_attachment(0, 0, attachment.name, attachment.media_type, attachment.data)
        writer.finish()
    return target


EDITS: dict[str, tuple[Keep, bool]] = {
    "events removed": (lambda topic, _: topic != "/simscen/events", False),
    "truth ends early": (lambda topic, t: topic != "/ground_truth/odom" or t < 1.0, False),
    "clearance ends early": (lambda topic, t: topic != "/simscen/clearance" or t < 1.0, False),
    "beginning removed": (lambda _, t: t > 1.0, False),
    "reverse order": (lambda *_: True, True),
}


def test_103_an_edited_log_does_not_pass(simscen, folder: Path, passed_log: Path) -> None:
    assert simscen("judge", passed_log).code == 0
    assert simscen("judge", rewrite(passed_log, folder / "copy.mcap", lambda *_: True, False)).code == 0
    for name, (keep, backwards) in EDITS.items():
        code = simscen("judge", rewrite(passed_log, folder / "edited.mcap", keep, backwards)).code
        assert code in (1, 2), name


def merge(logs: Sequence[Path], target: Path, end: str | None = None, delay_s: float = 0.0) -> Path:
    """Write the records of several logs into one, each with its own channels.

    `end` replaces the tick at which the run ended; `delay_s` is added to the log times of the truth.
    """
    with target.open("wb") as sink:
        writer = Writer(sink)
        writer.start("ros2", "a log editor")
        for log in logs:
            with log.open("rb") as source:
                reader = make_reader(source)
                channels: dict[int, int] = {}
                for record in reader.iter_metadata():
                    tick = {"tick": end} if end and "tick" in record.metadata else {}
                    writer.add_metadata(record.name, record.metadata | tick)
                for attachment in reader.iter_attachments():
                    writer.add_attachment(0, 0, attachment.name, attachment.media_type, attachment.data)
                for schema, channel, message in reader.iter_messages(log_time_order=False):
                    assert schema is not None
                    if channel.id not in channels:
                        registered = writer.register_schema(schema.name, schema.encoding, schema.data)
                        channels[channel.id] = writer.register_channel(channel.topic, "cdr", registered)
                    late = round(delay_s * 1e9) if channel.topic == "/ground_truth/odom" else 0
                    writer.add_message(channels[channel.id], message.log_time + late, message.data, message.log_time)
        writer.finish()
    return target


def test_111_a_log_that_contradicts_itself_is_refused(simscen, folder: Path, passed_log: Path) -> None:
    edited = folder / "edited.mcap"
    assert simscen("judge", merge([passed_log], edited)).code == 0
    for log in (
        merge([passed_log, passed_log], edited),
        merge([passed_log], folder / "early.mcap", end="1"),
        merge([passed_log], folder / "late.mcap", delay_s=0.5),
    ):
        ended = simscen("judge", log)
        assert ended.code == 2 and "the log is damaged" in ended.err, ended


def test_104_a_low_rate_of_the_truth_is_refused(with_scenario) -> None:
    assert "must be at least 20" in with_scenario(replace={"time_limit": "physics: {truth_rate: 1 Hz}\ntime_limit"})


def test_104_a_run_ends_at_its_time_limit(simscen, folder: Path) -> None:
    text = f"simscen: 1\n{ROOM}time_limit: 2 s\nphysics: {{truth_rate: 20 Hz}}\npass: [{{collisions: {{max: 0}}}}]\n"
    (folder / "a.scenario.yaml").write_text(text)
    assert simscen("run", "a.scenario.yaml", "--out", "out").code == 0
    (run,) = json.loads((folder / "out/results.json").read_text())["runs"]
    assert run["simulated_seconds"] == 2.0


def test_104_a_run_of_a_single_sample_is_refused(with_scenario) -> None:
    message = with_scenario(f"simscen: 1\n{ROOM}time_limit: 20 ms\npass: [{{collisions: {{max: 0}}}}]\n")
    assert "bad.scenario.yaml:4:13: error[SC036] nothing can be judged: the second sample" in message


def test_105_a_premise_that_was_never_known_to_be_true_is_inconclusive(simscen, folder: Path) -> None:
    whenever = "{whenever: {signal: speed, op: '>', value: 5}, then: {signal: speed, op: '<', value: 9}}"
    beyond_the_end = "{eventually: {signal: speed, op: '>', value: 5, within: 9 s}}"
    criteria = {
        "top-level": f"always: {whenever}",
        "nested": f"always: {{always: {whenever}}}",
        "nested-twice": f"always: {{all: [{whenever}]}}",
        "beyond": f"always: {{whenever: {beyond_the_end}, then: {{signal: speed, op: '<', value: 9}}}}",
    }
    (folder / "a.scenario.yaml").unlink()
    for name, criterion in criteria.items():
        text = f"simscen: 1\n{ROOM}time_limit: 1 s\npass: [{{{criterion}}}]\n"
        (folder / f"{name}.scenario.yaml").write_text(text)
    ended = simscen("run", ".", "--out", "out")
    assert ended.code == 1, ended
    runs = json.loads((folder / "out/results.json").read_text())["runs"]
    statuses = {run["scenario"]: [verdict["status"] for verdict in run["verdicts"]] for run in runs}
    assert statuses == {name: ["inconclusive"] for name in criteria}


def test_106_an_object_that_turns_too_far_in_a_tick_is_refused(simscen, folder: Path) -> None:
    move = "{keyframes: [[0 s, 3, 2, 0 deg], [1 s, 3, 2, 0 deg], [1.004 s, 3, 2, 90 deg]]}"
    world = f"  objects: [{{name: gate, box: [1.6, 0.04, 0.5], pose: {{x: 3, y: 2}}, move: {move}}}]\n"
    (folder / "a.scenario.yaml").write_text(
        f"simscen: 1\nworld:\n  simscen: 1\n{world}robot: {{model: cube.robot.yaml, pose: {{x: 1, y: 1}}}}\n"
        "time_limit: 2 s\npass: [{collisions: {max: 0}}]\n"
    )
    ended = simscen("run", "a.scenario.yaml", "--out", "out")
    assert ended.code == 2
    assert "in one physics tick" in ended.err


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("simscen: 1\n", "simscen: true\n"),
        ("time_limit: 20", "time_limit: ٢٠ s"),
        ("seed: 7", "name: ../../x\nseed: 7"),
    ],
    ids=["version", "digits", "name"],
)
def test_107_almost_valid_values_are_errors(with_scenario, old: str, new: str) -> None:
    assert "error[SC" in with_scenario(replace={old: new})


def odometry(seconds: float) -> Any:
    """Return nav_msgs/Odometry of a robot that drives along x, with its stamp."""
    stamp = round((1000.0 + seconds) * 1e9)
    header = T["std_msgs/msg/Header"](
        stamp=T["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="map"
    )
    vector, no_covariance = T["geometry_msgs/msg/Vector3"], np.zeros(36)
    pose = T["geometry_msgs/msg/Pose"](
        position=T["geometry_msgs/msg/Point"](x=SPEED_MPS * seconds, y=0.0, z=0.0),
        orientation=T["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
    )
    twist = T["geometry_msgs/msg/Twist"](linear=vector(x=SPEED_MPS, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0))
    return T["nav_msgs/msg/Odometry"](
        header=header,
        child_frame_id="base_link",
        pose=T["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=no_covariance),
        twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=no_covariance),
    )


def write_bag(folder: Path, times: Sequence[float], logged_from: float = 0.0) -> Path:
    """Write a rosbag2 with the true odometry at these times in s, of which none is logged before `logged_from`."""
    kind = "nav_msgs/msg/Odometry"
    with BagWriter(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/truth", kind, typestore=STORE)
        for seconds, latest in zip(times, np.maximum.accumulate(times), strict=True):
            data = bytes(STORE.serialize_cdr(odometry(seconds), kind))
            writer.write(connection, round((1000.01 + max(latest, logged_from)) * 1e9), data)
    return folder


BUSY_START_S = 1.1
"""Time until which a recorder of a public log is busy; it loses messages and logs the others at once."""
RNG = np.random.default_rng(5)
BUSY = np.arange(0.0, 10.0, 0.011)
GRID = np.arange(0.0, 10.0, 0.05)
TIMES: dict[str, tuple[Sequence[float], int]] = {
    "3 ms of jitter": (GRID + RNG.uniform(-0.003, 0.003, len(GRID)), 0),
    "30 Hz": (np.arange(300) / 30, 0),
    "120 Hz": (np.arange(1200) / 120, 0),
    "a lost message": (np.delete(GRID, 77), 0),
    "a repeated message": (np.insert(GRID, 77, GRID[77]), 0),
    "a late message": ([*GRID[:77], GRID[78], GRID[77], *GRID[79:]], 0),
    "a gap of 3 s": (GRID[(GRID < 3.0) | (GRID > 6.0)], 1),
    # Measured in public logs: a robot polled over Wi-Fi, motion capture in pairs, a busy recorder, and gaps of 12 s.
    "periods of 0.156 to 0.268 s": (np.cumsum(RNG.uniform(0.156, 0.268, 45)), 0),
    "pairs every 20 ms": (np.repeat(np.arange(0.0, 10.0, 0.02), 2) + np.tile([0.0, 2e-5], 500), 0),
    "a recorder with a busy start": (BUSY[((BUSY < 0.25) | (BUSY > 0.38)) & ((BUSY < 0.6) | (BUSY > 0.73))], 0),
    "a gap of 12 s": ([*GRID, *(GRID + 22.0)], 1),
}


@pytest.mark.parametrize("name", TIMES)
def test_108_logs_of_real_robots_are_judged(simscen, folder: Path, name: str) -> None:
    times, code = TIMES[name]
    (folder / "limits.yaml").write_text("pass:\n  - speed: {max: 0.6 m/s}\n")
    (folder / "tight.yaml").write_text("pass:\n  - speed: {max: 0.4 m/s}\n")
    bag = write_bag(folder / "bag", times, BUSY_START_S if "busy" in name else 0.0)
    ended = simscen("judge", bag, "--truth", "/truth", "--scenario", "limits.yaml")
    assert ended.code == code, ended
    assert simscen("judge", bag, "--truth", "/truth", "--scenario", "tight.yaml").code == 1


def test_109_localize_reports_the_share_of_beliefs_with_a_reference(simscen, folder: Path) -> None:
    write_map(folder)
    write_csv(folder)
    rows = (folder / "drive.csv").read_text().splitlines()
    truth = [row for row in rows if row.startswith("truth")][::40]
    kept = [row for row in rows if not row.startswith("truth") or row in truth]
    (folder / "drive.csv").write_text("\n".join(kept) + "\n")
    ended = simscen("localize", "drive.csv", "--map", "room.yaml", "--robot", "turtlebot", "--json")
    assert ended.code == 0
    assert json.loads(ended.out)["compared"] == pytest.approx(len(truth) / 150)
    assert "2.7% of the beliefs" in simscen("localize", "drive.csv", "--map", "room.yaml", "--robot", "turtlebot").out


@pytest.mark.slow
def test_110_resume_repeats_a_run_if_its_log_was_deleted_or_replaced(folder: Path) -> None:
    def run(*options: str) -> None:
        command = [sys.executable, "-m", "simscen", "run", "a.scenario.yaml", *options]
        assert subprocess.run(command, cwd=folder, capture_output=True, timeout=60, check=False).returncode == 0

    run("--out", "out")
    log = folder / "out/runs/a/seed-7/run.mcap"
    original = log.read_bytes()
    for replacement in (None, b"x" * len(original)):
        log.unlink()
        if replacement:
            log.write_bytes(replacement)
        run("--resume", "out")
        assert log.read_bytes() == original
