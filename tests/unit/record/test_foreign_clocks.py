"""Tests of clocks and stamps in logs of real robots: clock conversion, clock steps, and missing stamps."""

import random
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from foreign_logs import (
    BEGIN,
    LATENCY,
    SECOND,
    SPEED,
    STORE,
    Message,
    drive,
    estimated_pose,
    header,
    link,
    stamped_pose,
)  # fmt: skip

from simscen.core.records.verdict import Evidence
from simscen.record.foreign.options import ForeignLogOptions, TimeSource
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.foreign.read import ForeignLog
from simscen.record.foreign.timebase import check_recorder_clock, find_clock_step


def test_times_are_taken_from_message_headers(read: Callable[..., ForeignLog]) -> None:
    """AMCL's pose is logged 80 ms after the true pose with the same stamp, which is 4 cm at 0.5 m/s."""
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
    """Twist has no header, and with simulated time the clock of the log has another rate."""
    messages = [replace(entry, time=BEGIN + 2 * (entry.time - 5 * SECOND)) for entry in drive(begin=5 * SECOND)]
    trace = read(messages).trace
    assert trace.seconds(trace.end) == pytest.approx(10.0, abs=0.2)
    assert np.abs(trace.command.ticks - trace.truth.ticks).max() <= 2


def test_repeated_and_late_stamps_are_sorted_and_noted(read: Callable[..., ForeignLog]) -> None:
    messages = [entry for entry in drive() if entry.topic == "/mocap"]
    first, second = messages[10:12]
    messages[10:12] = [replace(first, message=second.message), replace(second, message=first.message)]
    messages.insert(51, replace(messages[50], time=messages[50].time + 1))
    log = read(messages)
    assert len(log.trace.truth) == 201
    assert (np.diff(log.trace.truth.ticks) > 0).all()
    assert (np.diff(log.trace.truth.values[:, 0]) > 0).all()
    assert log.notes == ["/mocap: 1 messages out of order, 1 repeated stamps, of which the last message is used"]


def test_stamps_that_do_not_advance_are_refused(refused: Callable[..., str]) -> None:
    """Otherwise, the whole drive would be judged as one moment."""
    messages = [entry for entry in drive() if entry.topic == "/mocap"]
    frozen = [replace(entry, message=replace(entry.message, header=header(BEGIN, "map"))) for entry in messages]
    assert "the stamps of the 201 messages of /mocap do not advance" in refused(frozen)


def test_a_single_true_pose_shows_neither_path_nor_velocity(read: Callable[..., ForeignLog]) -> None:
    (first, *_) = (entry for entry in drive() if entry.topic == "/mocap")
    missing = read([first]).coverage.missing
    reason = "/mocap has messages of only one time"
    assert (missing[Evidence.TRUTH], missing[Evidence.VELOCITY]) == (reason, reason)


def test_a_clock_that_jumps_back_is_refused(refused: Callable[..., str]) -> None:
    messages = drive(4.0) + [replace(entry, time=entry.time + 5 * SECOND) for entry in drive(4.0)]
    assert refused(messages).startswith("SC804 the time of /mocap jumps back by 4.0 s at its message 82 (")


def with_clock_step(seconds: float, also_recorder: bool = False) -> list[Message]:
    """Return a drive in which the clock of the stamps is set by `seconds` after 5 s.

    With `also_recorder`, the clock of the recorder is set, too.
    """
    step, messages = round(seconds * SECOND), []
    for entry in drive():
        if entry.time > BEGIN + 5 * SECOND + LATENCY and hasattr(entry.message, "header"):
            stamp = entry.message.header.stamp
            stepped = header(stamp.sec * SECOND + stamp.nanosec + step, entry.message.header.frame_id)
            time = entry.time + step if also_recorder else entry.time
            messages.append(Message(entry.topic, time, replace(entry.message, header=stepped)))
        else:
            messages.append(entry)
    return messages


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
    """Return log times and stamps in ns of a topic at 90 Hz, as in a public log.

    The recorder starts late: messages before 1.1 s are logged at 1.1 s, and some of them are lost. The clock of the
    stamps is set by `step` ns at 5 s.
    """
    stamps = np.arange(0, 10 * SECOND, 11_000_000)
    is_lost = np.zeros(len(stamps), dtype=bool)
    for first in (6, 30, 50):
        is_lost[first : first + 12] = True
    stamps = stamps[~is_lost]
    logged = np.maximum(stamps, round(1.1 * SECOND)) + LATENCY
    return logged, stamps + np.where(stamps >= 5 * SECOND, step, 0)


def test_busy_start_of_the_recorder_is_not_a_clock_step() -> None:
    assert find_clock_step(*with_busy_start()) is None
    found = find_clock_step(*with_busy_start(round(0.3 * SECOND)))
    assert found is not None
    assert found[1] == pytest.approx(0.3 * SECOND, abs=0.02 * SECOND)


def test_log_is_judged_from_the_first_recorded_scan(read: Callable[..., ForeignLog]) -> None:
    late = [entry for entry in drive() if entry.topic != "/scan" or entry.time > BEGIN + SECOND]
    log = read(late)
    assert log.notes == ["/scan is recorded 1.0 s after the first message; the log is judged from then on"]
    assert (log.trace.scans[0], log.trace.seconds(log.trace.end)) == (0, pytest.approx(9.1, abs=0.1))
    assert log.trace.truth.values[0, 0] == pytest.approx(SPEED * 1.0, abs=0.03)
    silent = read([entry for entry in drive() if entry.topic != "/scan" or entry.time > BEGIN + 3 * SECOND])
    assert (silent.notes, silent.trace.scans[0]) == ([], pytest.approx(3000, abs=50))


def test_clock_of_the_recorder_that_is_set_back_is_refused(refused: Callable[..., str]) -> None:
    text = "SC804 the clock of the recorder was set back by 0.5 s at message 102 of /mocap ("
    assert refused(with_clock_step(-0.55, also_recorder=True)).startswith(text)


@pytest.mark.parametrize(
    ("parts", "is_refused"),
    [
        ([(0, 100), (90, 105)], True),
        ([(0, 100), (90, 95)], True),
        ([(50, 100), (40, 95)], True),
        ([(50, 100), (0, 50)], False),
        ([(60, 100), (30, 60), (0, 30)], False),
    ],
)
def test_recorder_clock_was_set_back_if_parts_of_the_log_overlap(
    parts: list[tuple[int, int]], is_refused: bool
) -> None:
    times = [second * SECOND for begin, end in parts for second in range(begin, end)]
    with pytest.raises(UnusableLog, match="was set back") if is_refused else nullcontext():
        check_recorder_clock("/odom", times, times)


def with_delay(messages: list[Message], start: float, end: float, seconds: float) -> list[Message]:
    """Return messages of one topic. Those between `start` and `end` in s are logged late by `seconds`."""
    late, last = [], 0
    for entry in messages:
        is_late = start * SECOND <= entry.time - BEGIN < end * SECOND
        last = max(last, entry.time + (round(seconds * SECOND) if is_late else 0))
        late.append(replace(entry, time=last))
    return late


@pytest.mark.parametrize("change", ["shuffled", "reversed", "stalled", "slow start", "slow end", "jitter"])
def test_order_and_delay_of_logging_do_not_change_stamped_poses(read: Callable[..., ForeignLog], change: str) -> None:
    messages, rng = [entry for entry in drive() if entry.topic == "/mocap"], random.Random(4)
    changed = {
        "shuffled": lambda: rng.sample(messages, len(messages)),
        "reversed": lambda: messages[::-1],
        "stalled": lambda: with_delay(messages, 4.0, 5.0, 1.5),
        "slow start": lambda: with_delay(messages, 0.0, 3.0, 0.5),
        "slow end": lambda: with_delay(messages, 5.0, 99.0, 0.5),
        "jitter": lambda: [replace(entry, time=entry.time + rng.randrange(SECOND // 3)) for entry in messages],
    }[change]()
    assert (read(changed).trace.truth.values == read(messages).trace.truth.values).all()


def test_topics_of_different_clocks_are_refused(refused: Callable[..., str], read: Callable[..., ForeignLog]) -> None:
    messages = [entry for entry in drive() if entry.topic == "/mocap"]
    messages += [Message("/amcl_pose", BEGIN + k * SECOND, estimated_pose(k * SECOND, SPEED * k)) for k in range(10)]
    assert "/amcl_pose and /mocap do not share a clock" in refused(messages)
    assert len(read(messages, ForeignLogOptions(truth="/mocap", clock="log")).trace.belief) == 10


@pytest.mark.parametrize("begin", [BEGIN, 100 * SECOND])
@pytest.mark.parametrize("index", [0, 1, 5])
@pytest.mark.parametrize("topic", ["/mocap", "/amcl_pose", "/odom", "/scan"])
def test_single_messages_without_a_stamp_do_not_move_the_others(
    read: Callable[..., ForeignLog], topic: str, index: int, begin: int
) -> None:
    """Drivers send such messages until they know the time."""
    messages, expected = drive(begin=begin), read(drive(begin=begin)).trace
    unstamped = [entry for entry in messages if entry.topic == topic][index]
    unstamped.message.header.stamp = header(0, "").stamp
    log = read(messages)
    trace = log.trace
    assert list(log.notes) == ([] if topic == "/scan" else [f"{topic}: messages without a stamp are ignored (1)"])
    assert trace.end == expected.end and not log.coverage.partial
    for name in ("truth", "belief", "odometry"):
        samples, expected_samples = getattr(trace, name), getattr(expected, name)
        assert len(expected_samples) - len(samples) <= 1
        rows = np.isin(expected_samples.ticks, samples.ticks)
        assert rows.sum() == len(samples)
        np.testing.assert_array_equal(samples.values, expected_samples.values[rows])
    assert len(trace.scans) == len(expected.scans)
    assert np.abs(trace.scans - expected.scans).max() <= 20


def test_plans_are_in_the_order_of_their_stamps(read: Callable[..., ForeignLog]) -> None:
    plan = STORE.types["nav_msgs/msg/Path"]
    late = [
        Message(
            "/plan", BEGIN + logged * SECOND, plan(header(BEGIN + at * SECOND, "map"), [stamped_pose(0, "map", at)])
        )
        for logged, at in ((5, 4), (6, 3), (8, 7))
    ]
    plans = read([*drive(), *late]).trace.plans
    assert [(path.tick, path.points[0, 0]) for path in plans] == [(3000, 3.0), (4000, 4.0), (7000, 7.0)]


def test_log_times_replace_zero_stamps(read: Callable[..., ForeignLog]) -> None:
    messages = [entry for entry in drive() if entry.topic != "/mocap"]
    poses = [stamped_pose(0, "map", SPEED * k / 20) for k in range(201)]
    messages += [Message("/mocap", BEGIN + k * SECOND // 20, pose) for k, pose in enumerate(poses)]
    log = read(messages)
    assert len(log.trace.truth) == 201
    assert log.notes == ["/mocap: all stamps are zero, so the times of logging are used"]


def transform_messages(stamp_of_step: Callable[[int], int]) -> list[Message]:
    """Return a drive on /tf, map → odom → base_link, at 20 Hz. `stamp_of_step` returns the stamp of step k in ns."""
    messages = []
    for k in range(201):
        time, stamp = BEGIN + k * SECOND // 20, stamp_of_step(k)
        messages.append(Message("/tf", time, link(stamp, "map", "odom", SPEED * k / 40)))
        messages.append(Message("/tf", time, link(stamp, "odom", "base_link", SPEED * k / 40)))
    return messages


@pytest.mark.parametrize("clock", ["header", "log"])
def test_log_times_replace_zero_stamps_of_transforms(read: Callable[..., ForeignLog], clock: TimeSource) -> None:
    log = read(transform_messages(lambda _: 0), ForeignLogOptions(truth="map:base_link", clock=clock))
    np.testing.assert_allclose(log.trace.truth.values[:, 0], SPEED * log.trace.truth.ticks / 1000, atol=1e-6)
    assert len(log.trace.truth) == 201


def test_transforms_of_a_clock_that_jumps_back_are_judged_by_log_times(
    read: Callable[..., ForeignLog], refused: Callable[..., str]
) -> None:
    messages = transform_messages(lambda k: BEGIN + k * SECOND // 20 - (5 * SECOND if k > 100 else 0))
    assert "the time of tf map:base_link jumps back by 5.0 s" in refused(messages, ForeignLogOptions("map:base_link"))
    log = read(messages, ForeignLogOptions(truth="map:base_link", clock="log"))
    np.testing.assert_allclose(log.trace.truth.values[:, 0], SPEED * log.trace.truth.ticks / 1000, atol=1e-6)


def test_order_of_transforms_in_the_file_does_not_matter(read: Callable[..., ForeignLog]) -> None:
    messages, options = transform_messages(lambda k: BEGIN + k * SECOND // 20), ForeignLogOptions(truth="map:base_link")
    shuffled = random.Random(1).sample(messages, len(messages))
    assert (read(shuffled, options).trace.truth.values == read(messages, options).trace.truth.values).all()
