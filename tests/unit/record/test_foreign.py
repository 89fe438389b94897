"""Reading the logs of real robots."""

import random
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign_logs import (
    BEGIN,
    CHUNKED,
    LATENCY,
    SECOND,
    SPEED,
    STORE,
    UNINDEXED,
    Said,
    believed,
    drive,
    header,
    link,
    odometry,
    stamped_pose,
    statuses,
    write_bag,
    write_mcap,
)  # fmt: skip
from rosbags.rosbag2 import StoragePlugin

from simscen.core.errors import InvalidInput
from simscen.core.records.events import EventKind
from simscen.core.records.verdict import Evidence
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.read import ForeignLog, read_foreign_log
from simscen.record.foreign.timebase import find_clock_step

MOCAP = ForeignLogOptions(truth="/mocap")
WRITERS: dict[str, Callable[[Path, list[Said]], Path]] = {
    "sqlite": lambda path, said: write_bag(path / "bag", said),
    "sqlite, files compressed": lambda path, said: write_bag(path / "bag", said, compress="file"),
    "sqlite, messages compressed": lambda path, said: write_bag(path / "bag", said, compress="message"),
    "rosbag2 of mcap": lambda path, said: write_bag(path / "bag", said, StoragePlugin.MCAP),
    "rosbag2 of mcap, messages compressed": lambda path, said: write_bag(
        path / "bag", said, StoragePlugin.MCAP, "message"
    ),
    "mcap without chunks or index": lambda path, said: write_mcap(path / "a.mcap", said, **UNINDEXED),
    **{
        f"mcap {name}": lambda path, said, options=options: write_mcap(path / "a.mcap", said, **options)  # type: ignore[misc]
        for name, options in CHUNKED.items()
    },
}


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., ForeignLog]:
    """Writes messages as an MCAP file and reads it."""

    def call(said: list[Said], wanted: ForeignLogOptions = MOCAP, **options: Any) -> ForeignLog:
        return read_foreign_log(write_mcap(tmp_path / "a.mcap", said, **options), wanted)

    return call


@pytest.fixture
def refused(read: Callable[..., ForeignLog]) -> Callable[..., str]:
    """Why a log cannot be used."""

    def call(said: list[Said], wanted: ForeignLogOptions = MOCAP, **options: Any) -> str:
        with pytest.raises(InvalidInput) as raised:
            read(said, wanted, **options)
        (problem,) = raised.value.problems
        return f"{problem.code} {problem.message} ({problem.hint})"

    return call


@pytest.mark.parametrize("writer", WRITERS)
def test_every_container_gives_the_same_trace(tmp_path: Path, writer: str) -> None:
    log = read_foreign_log(WRITERS[writer](tmp_path, drive()), MOCAP)
    trace = log.trace
    assert not log.notes
    assert (trace.tick_rate, trace.seconds(trace.end)) == (1000, pytest.approx(10.0, abs=0.1))
    assert len(trace.truth) == len(trace.odometry) == len(trace.command) == 201
    assert len(trace.belief) == len(trace.scans) == 21
    np.testing.assert_allclose(trace.truth.values[:, 0], SPEED * trace.truth.ticks / 1000, atol=0.02)
    np.testing.assert_allclose(trace.velocity.values, np.tile([SPEED, 0, 0], (201, 1)), atol=1e-6)
    np.testing.assert_allclose(trace.belief.values[:, 3:], np.tile([0.01, 0, 0, 0.01, 0, 0.01], (21, 1)))
    assert [event.kind for event in trace.events] == [EventKind.RUN_ENDED]
    assert not log.coverage.partial
    assert set(Evidence) - set(log.coverage.missing) == {
        Evidence.TRUTH, Evidence.VELOCITY, Evidence.BELIEF, Evidence.COVARIANCE, Evidence.ALIGNMENT,
        Evidence.SCANS, Evidence.COMMANDS,
    }  # fmt: skip


def test_times_are_those_of_the_headers(read: Callable[..., ForeignLog]) -> None:
    """AMCL's pose is logged 80 ms after the truth of the same moment; at 0.5 m/s that would be 4 cm of error."""
    log = read(drive(off=0.0))
    error = log.trace.belief.values[:, 0] - np.interp(
        log.trace.belief.ticks, log.trace.truth.ticks, log.trace.truth.values[:, 0]
    )
    assert np.abs(error).max() < 1e-3
    by_log = read(drive(off=0.0), ForeignLogOptions(truth="/mocap", clock="log"))
    late = by_log.trace.belief.values[:, 0] - np.interp(
        by_log.trace.belief.ticks, by_log.trace.truth.ticks, by_log.trace.truth.values[:, 0]
    )
    assert np.abs(late[:-1]).max() == pytest.approx(0.04, abs=0.002)


def test_times_without_header_are_converted_to_the_clock_of_the_headers(read: Callable[..., ForeignLog]) -> None:
    """Twist has no header; with simulated time the log's own clock is another one, and runs at another rate."""
    said = [replace(one, time=BEGIN + 2 * (one.time - 5 * SECOND)) for one in drive(begin=5 * SECOND)]
    trace = read(said).trace
    assert trace.seconds(trace.end) == pytest.approx(10.0, abs=0.2)
    assert np.abs(trace.command.ticks - trace.truth.ticks).max() <= 2


def test_without_a_truth_nothing_is_known_of_it_and_the_reason_names_what_could_be(
    read: Callable[..., ForeignLog],
) -> None:
    log = read(drive(), ForeignLogOptions())
    assert len(log.trace.truth) == 0
    assert log.coverage.missing[Evidence.TRUTH] == (
        "no ground truth: name a topic or two frames with --truth; topics with poses: /amcl_pose, /mocap, /odom"
    )
    assert "no topic /vicon" in read(drive(), ForeignLogOptions(truth="/vicon")).coverage.missing[Evidence.TRUTH]


def test_two_frames_of_tf_can_be_the_truth(read: Callable[..., ForeignLog]) -> None:
    """map ← odom holds until it is told anew, odom ← base moves, base ← marker is static."""
    said = drive()
    for k in range(201):
        stamp = BEGIN + k * SECOND // 20
        said.append(Said("/tf", stamp, link(stamp, "odom", "base_link", SPEED * k / 20)))
    for at, offset in ((0, 1.0), (5, 2.0)):
        said.append(Said("/tf", BEGIN + at * SECOND, link(BEGIN + at * SECOND, "map", "odom", 0.0, offset, 1.5707963)))
    said.append(Said("/tf_static", BEGIN, link(0, "/base_link", "/marker", 0.25)))
    trace = read(said, ForeignLogOptions(truth="map:marker")).trace
    x, y, yaw = trace.truth.values.T
    np.testing.assert_allclose(x, 0.0, atol=1e-6)
    offset = np.where(trace.truth.ticks < 5000, 1.0, 2.0)
    np.testing.assert_allclose(y, offset + 0.25 + SPEED * trace.truth.ticks / 1000, atol=2e-3)
    np.testing.assert_allclose(yaw, np.pi / 2, atol=1e-6)
    lost = read(said, ForeignLogOptions(truth="map:wheel")).coverage.missing[Evidence.TRUTH]
    assert lost == "tf does not connect map with wheel; frames: base_link, map, marker, odom"


def test_a_truth_in_a_frame_of_its_own_is_not_compared_with_the_map(read: Callable[..., ForeignLog]) -> None:
    log = read(drive(mocap="vicon"))
    assert "frame `vicon`, the map frame is `map`" in log.coverage.missing[Evidence.ALIGNMENT]
    assert Evidence.TRUTH not in log.coverage.missing
    same = read(drive(mocap="vicon"), ForeignLogOptions(truth="/mocap", same_frame=True))
    assert Evidence.ALIGNMENT not in same.coverage.missing


def test_repeated_and_late_stamps_are_sorted_and_noted(read: Callable[..., ForeignLog]) -> None:
    said = [one for one in drive() if one.topic == "/mocap"]
    said[10], said[11] = replace(said[10], message=said[11].message), replace(said[11], message=said[10].message)
    said.insert(51, replace(said[50], time=said[50].time + 1))
    log = read(said)
    assert len(log.trace.truth) == 201
    assert (np.diff(log.trace.truth.ticks) > 0).all()
    assert (np.diff(log.trace.truth.values[:, 0]) > 0).all()
    assert log.notes == ["/mocap: 1 messages out of order, 1 repeated stamps, of which the last message is used"]


def test_a_clock_that_jumps_back_is_refused(refused: Callable[..., str]) -> None:
    said = drive(4.0) + [replace(one, time=one.time + 5 * SECOND) for one in drive(4.0)]
    assert refused(said).startswith("SC804 the time of /mocap jumps back by 4.0 s at its message 82 (")


def with_clock_step(seconds: float, also_recorder: bool = False) -> list[Said]:
    """A drive during which the clock of the stamps, and perhaps that of the recorder, is set after 5 s."""
    step, said = round(seconds * SECOND), []
    for one in drive():
        if one.time > BEGIN + 5 * SECOND + LATENCY and hasattr(one.message, "header"):
            stamp = one.message.header.stamp
            moved = header(stamp.sec * SECOND + stamp.nanosec + step, one.message.header.frame_id)
            time = one.time + step if also_recorder else one.time
            said.append(Said(one.topic, time, replace(one.message, header=moved)))
        else:
            said.append(one)
    return said


@pytest.mark.parametrize("seconds", [-0.9, -0.3, 0.3, 0.9, 3.0])
def test_clock_that_is_set_while_recording_is_refused(
    refused: Callable[..., str], read: Callable[..., ForeignLog], seconds: float
) -> None:
    direction = "back" if seconds < 0 else "forward"
    text = f"SC804 the clock of /mocap was set {direction} by {abs(seconds):.1f} s at its message 102 ("
    assert refused(with_clock_step(seconds)).startswith(text)
    by_log = read(with_clock_step(seconds), ForeignLogOptions(truth="/mocap", clock="log"))
    assert by_log.trace.velocity.values[:, 0] == pytest.approx(SPEED, abs=1e-6)


def with_busy_start(step: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Times of logging and stamps in ns of a public log: 90 Hz, logged from 1.1 s on, with losses of 0.1 s before.

    The clock of the stamps is set by `step` ns at 5 s.
    """
    stamps = np.arange(0, 10 * SECOND, 11_000_000)
    is_lost = np.zeros(len(stamps), dtype=bool)
    for begin in (6, 30, 50):
        is_lost[begin : begin + 12] = True
    stamps = stamps[~is_lost]
    logged = np.maximum(stamps, round(1.1 * SECOND)) + LATENCY
    return logged, stamps + np.where(stamps >= 5 * SECOND, step, 0)


def test_a_recorder_that_catches_up_after_a_busy_start_is_no_clock_that_was_set() -> None:
    assert find_clock_step(*with_busy_start()) is None
    found = find_clock_step(*with_busy_start(round(0.3 * SECOND)))
    assert found is not None
    assert found[1] == pytest.approx(0.3 * SECOND, abs=0.02 * SECOND)


def test_a_log_is_judged_from_when_the_recorder_has_subscribed_to_scans(read: Callable[..., ForeignLog]) -> None:
    late = [one for one in drive() if one.topic != "/scan" or one.time > BEGIN + SECOND]
    log = read(late)
    assert log.notes == ["/scan is recorded 1.0 s after the first message; the log is judged from then on"]
    assert (log.trace.scans[0], log.trace.seconds(log.trace.end)) == (0, pytest.approx(9.1, abs=0.1))
    assert log.trace.truth.values[0, 0] == pytest.approx(SPEED * 1.0, abs=0.03)
    silent = read([one for one in drive() if one.topic != "/scan" or one.time > BEGIN + 3 * SECOND])
    assert (silent.notes, silent.trace.scans[0]) == ([], pytest.approx(3000, abs=50))


def test_clock_of_the_recorder_that_is_set_back_is_refused(refused: Callable[..., str]) -> None:
    text = "SC804 the clock of the recorder was set back by 0.5 s at message 102 of /mocap ("
    assert refused(with_clock_step(-0.55, also_recorder=True)).startswith(text)


def delayed(said: list[Said], begin: float, end: float, seconds: float) -> list[Said]:
    """Messages of one topic, of which those between two times (s) are logged late, and none before an earlier one."""
    late, last = [], 0
    for one in said:
        is_late = begin * SECOND <= one.time - BEGIN < end * SECOND
        last = max(last, one.time + (round(seconds * SECOND) if is_late else 0))
        late.append(replace(one, time=last))
    return late


@pytest.mark.parametrize("change", ["shuffled", "reversed", "stalled", "slow start", "slow end", "jitter"])
def test_order_and_delay_of_logging_do_not_change_stamped_poses(read: Callable[..., ForeignLog], change: str) -> None:
    said, rng = [one for one in drive() if one.topic == "/mocap"], random.Random(4)
    changed = {
        "shuffled": lambda: rng.sample(said, len(said)),
        "reversed": lambda: said[::-1],
        "stalled": lambda: delayed(said, 4.0, 5.0, 1.5),
        "slow start": lambda: delayed(said, 0.0, 3.0, 0.5),
        "slow end": lambda: delayed(said, 5.0, 99.0, 0.5),
        "jitter": lambda: [replace(one, time=one.time + rng.randrange(SECOND // 3)) for one in said],
    }[change]()
    assert (read(changed).trace.truth.values == read(said).trace.truth.values).all()


def test_topics_of_different_clocks_are_refused(refused: Callable[..., str], read: Callable[..., ForeignLog]) -> None:
    said = [one for one in drive() if one.topic == "/mocap"]
    said += [Said("/amcl_pose", BEGIN + k * SECOND, believed(k * SECOND, SPEED * k)) for k in range(10)]
    assert "/amcl_pose and /mocap do not share a clock" in refused(said)
    assert len(read(said, ForeignLogOptions(truth="/mocap", clock="log")).trace.belief) == 10


def test_stamps_that_were_never_set_are_not_used(read: Callable[..., ForeignLog]) -> None:
    said = [one for one in drive() if one.topic != "/mocap"]
    said += [Said("/mocap", BEGIN + k * SECOND // 20, stamped_pose(0, "map", SPEED * k / 20)) for k in range(201)]
    log = read(said)
    assert len(log.trace.truth) == 201
    assert log.notes == ["/mocap: all stamps are zero, so the times of logging are used"]


def test_a_gap_in_the_truth_leaves_room_for_doubt(read: Callable[..., ForeignLog]) -> None:
    gone = (BEGIN + 4 * SECOND, BEGIN + 6 * SECOND)
    log = read([one for one in drive() if one.topic != "/mocap" or not gone[0] < one.time < gone[1]])
    assert log.coverage.partial[Evidence.TRUTH].startswith("/mocap has no message from t = 3.9")
    late = read([one for one in drive() if one.topic != "/mocap" or one.time > gone[1]])
    assert late.coverage.partial[Evidence.TRUTH].startswith("/mocap has no message from t = 0.00 s to 6.0")


def test_a_belief_that_begins_after_a_meter_of_driving_leaves_room_for_doubt(read: Callable[..., ForeignLog]) -> None:
    log = read([one for one in drive() if one.topic != "/amcl_pose" or one.time > BEGIN + 2 * SECOND])
    assert log.coverage.partial[Evidence.BELIEF].startswith("/amcl_pose starts at t = 2.0")


def test_twists_that_were_never_set_are_not_a_standstill(read: Callable[..., ForeignLog]) -> None:
    said = [Said("/gps", BEGIN + k * SECOND // 20, odometry(BEGIN + k * SECOND // 20, "map", SPEED * k / 20, 0.0))
            for k in range(201)]  # fmt: skip
    log = read(said, ForeignLogOptions(truth="/gps"))
    assert log.notes == [
        "/gps: all twists are zero although the robot moves, so velocities are computed from the poses"
    ]
    np.testing.assert_allclose(log.trace.velocity.values[:, 0], SPEED, atol=1e-6)


@pytest.mark.parametrize("size", [0.2, 0.5, 0.9, 0.995])
def test_a_log_that_breaks_off_has_no_end(tmp_path: Path, size: float) -> None:
    file = write_mcap(tmp_path / "a.mcap", drive(), **UNINDEXED)
    data = file.read_bytes()
    file.write_bytes(data[: int(len(data) * size)])
    log = read_foreign_log(file, MOCAP)
    assert not log.trace.events
    assert log.notes == ["the log is truncated, so no criterion can pass"]


def test_a_log_of_ros_1_is_refused(refused: Callable[..., str], tmp_path: Path) -> None:
    assert refused(drive(), profile="ros1").startswith("SC804 it is a log of ROS 1 (")
    assert refused(drive(), profile="", encoding="ros1").startswith("SC804 it is a log of ROS 1 (")
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(InvalidInput, match="it is a bag of ROS 1"):
        read_foreign_log(tmp_path / "a.bag", MOCAP)


def test_topic_of_another_type_is_ignored_with_a_note(read: Callable[..., ForeignLog]) -> None:
    renamed = [replace(one, topic="/amcl_pose") for one in drive() if one.topic == "/scan"]
    log = read([*(one for one in drive() if one.topic != "/amcl_pose"), *renamed])
    assert log.coverage.missing[Evidence.BELIEF].startswith("/amcl_pose is a sensor_msgs/msg/LaserScan, expected ")


def test_messages_that_are_not_cdr_are_ignored_with_a_note(refused: Callable[..., str]) -> None:
    assert "/mocap is encoded as json, not as CDR" in refused(drive(), encoding="json")


def test_messages_that_do_not_fit_their_type_are_refused(refused: Callable[..., str]) -> None:
    only = [one for one in drive() if one.topic == "/mocap"]
    cut = refused(only, change=lambda data: data[:40])
    assert "message 1 of /mocap cannot be read as geometry_msgs/msg/PoseStamped" in cut
    assert "longer than its type" in refused(only, change=lambda data: data + bytes(8))
    assert "not plain CDR" in refused(only, change=lambda data: b"\x28\xb5\x2f\xfd" + data[4:])
    zero = [Said("/mocap", BEGIN, replace_orientation(stamped_pose(BEGIN, "map", 0.0)))]
    assert "not a quaternion" in refused(zero)


def replace_orientation(message: Any) -> Any:
    """The message with an orientation that nobody filled in."""
    turn = STORE.types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=0.0)
    where = STORE.types["geometry_msgs/msg/Pose"](position=message.pose.position, orientation=turn)
    return STORE.types["geometry_msgs/msg/PoseStamped"](header=message.header, pose=where)


def test_big_endian_messages_are_read(tmp_path: Path) -> None:
    said = [one for one in drive() if one.topic == "/mocap"]
    little = read_foreign_log(write_mcap(tmp_path / "l.mcap", said), MOCAP)
    big = [bytes(STORE.serialize_cdr(one.message, one.message.__msgtype__, little_endian=False)) for one in said]
    rest = iter(big)
    log = read_foreign_log(write_mcap(tmp_path / "b.mcap", said, change=lambda _: next(rest)), MOCAP)
    assert np.array_equal(log.trace.truth.values, little.trace.truth.values)


def test_a_log_of_none_of_the_topics_is_refused_with_those_it_has(refused: Callable[..., str]) -> None:
    told = refused([replace(one, topic="/robot1" + one.topic) for one in drive()])
    assert told.startswith("SC804 it has no messages that can be judged (its topics: /robot1/amcl_pose, ")
    other = refused([], ForeignLogOptions())
    assert "its topics: none" in other


def test_topics_may_have_other_names(read: Callable[..., ForeignLog]) -> None:
    names = {name: f"/robot1/{name}" for name in ("odom", "amcl_pose", "scan", "cmd_vel")}
    log = read(
        [replace(one, topic="/robot1" + one.topic) for one in drive()], ForeignLogOptions("/robot1/mocap", names)
    )
    assert len(log.trace.belief) == 21 and len(log.trace.truth) == 201


def test_action_status_gives_goal_results(read: Callable[..., ForeignLog]) -> None:
    topic = "/navigate_to_pose/_action/status"
    said = [
        *drive(),
        Said(topic, BEGIN + 1 * SECOND, statuses((9, BEGIN - SECOND, 4), (1, BEGIN + SECOND, 1))),
        Said(topic, BEGIN + 4 * SECOND, statuses((9, BEGIN - SECOND, 4), (1, BEGIN + SECOND, 4))),
        Said(topic, BEGIN + 5 * SECOND, statuses((1, BEGIN + SECOND, 4), (2, BEGIN + 5 * SECOND, 2))),
        Said(topic, BEGIN + 8 * SECOND, statuses((2, BEGIN + 5 * SECOND, 6))),
    ]
    log = read(said, ForeignLogOptions(truth="/mocap", goals=("shelf", "dock")))
    told = [(str(event.kind), event.name, round(log.trace.seconds(event.tick))) for event in log.trace.events]
    assert told == [
        ("goal.accepted", "shelf", 1), ("goal.reached", "shelf", 4), ("goal.accepted", "dock", 5),
        ("goal.failed", "dock", 8), ("navigation.ended", "FAILED", 8), ("run.ended", "the recording ends", 10),
    ]  # fmt: skip
    one = read(said, ForeignLogOptions(truth="/mocap", goals=("shelf",)))
    assert one.coverage.missing[Evidence.NAVIGATION] == "the log has 2 goals, the scenario 1 goal"


def test_a_bag_without_rosbags_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bag = write_bag(tmp_path / "bag", drive(1.0))
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(InvalidInput) as raised:
        read_foreign_log(bag, MOCAP)
    assert raised.value.problems[0].hint == "pip install 'rosbags>=0.10,<1'"


@pytest.mark.parametrize("spoil", ["cut", "empty", "no metadata", "not yaml"])
def test_a_damaged_bag_is_reported_without_a_traceback(tmp_path: Path, spoil: str) -> None:
    bag = write_bag(tmp_path / "bag", drive())
    (database,) = bag.glob("*.db3")
    match spoil:
        case "cut":
            database.write_bytes(database.read_bytes()[:5000])
        case "empty":
            database.write_bytes(b"")
        case "no metadata":
            (bag / "metadata.yaml").unlink()
        case "not yaml":
            (bag / "metadata.yaml").write_text("[")
    with pytest.raises(InvalidInput) as raised:
        read_foreign_log(bag, MOCAP)
    assert raised.value.problems[0].code in ("SC800", "SC804")
