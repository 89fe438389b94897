"""Tests that damaged logs are read in part, or refused with InvalidInput."""

import os
import signal
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from moments import CASE, CLOCK, moments, sample_header

from simscen.core.errors import InvalidInput
from simscen.core.records.trace import Trace
from simscen.record import mcap_reader
from simscen.record.log_reader import Log, read_log
from simscen.record.mcap_reader import RecordReader
from simscen.record.recorder import Recorder
from simscen.record.trace_builder import TraceBuilder

HERE = Path(__file__).parent


def write_log(path: Path, seconds: float) -> Trace:
    """Write a complete log, and return the trace of its moments."""
    builder, end = TraceBuilder(CLOCK), CLOCK.ticks(seconds)
    with Recorder(path, CLOCK, sample_header()) as recorder:
        for moment in moments(seconds):
            recorder.append(moment)
            builder.append(moment)
        recorder.close(end)
    return builder.finish(end)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    write_log(path, 1.0)
    return path


def log_of_killed_process(folder: Path, seconds: float) -> Path:
    """Return the log of a process that is killed by SIGKILL after `seconds` of simulated time."""
    code = f"""if True:
        import os, signal, sys
        sys.path.insert(0, {str(HERE)!r})
        from moments import CLOCK, sample_header, moments
        from simscen.record.moment_buffer import MOMENT_DELAY_S, MomentBuffer
        from simscen.record.recorder import Recorder
        recorder = Recorder({str(folder / "run.mcap")!r}, CLOCK, sample_header())
        log = MomentBuffer(CLOCK.ticks(MOMENT_DELAY_S), recorder).sink(recorder.robots[""])
        for moment in moments({seconds}):
            log.append(moment)
        os.kill(os.getpid(), signal.SIGKILL)
    """
    process = subprocess.run([sys.executable, "-c", code], check=False, cwd=HERE.parents[2], env=dict(os.environ))
    assert process.returncode == -signal.SIGKILL
    return folder / "run.partial.mcap"


def test_a_killed_log_keeps_95_percent_of_its_messages(tmp_path: Path) -> None:
    partial = log_of_killed_process(tmp_path, 20.0)
    whole = write_log(tmp_path / "whole.mcap", 20.0)
    log = read_log(partial)
    assert not log.complete
    assert log.header.case == CASE
    assert len(log.trace.truth) >= 0.95 * len(whole.truth)
    assert log.trace.end >= 0.95 * whole.end
    assert log.trace.odometry.values.tolist() == whole.odometry.values[: len(log.trace.odometry)].tolist()


def test_the_mcap_library_streams_a_killed_log(tmp_path: Path) -> None:
    count = 0
    with log_of_killed_process(tmp_path, 5.0).open("rb") as stream, pytest.raises(EndOfFile):
        for record in StreamReader(stream).records:
            count += isinstance(record, Message)
    assert count > 1000


def problem(path: Path) -> str:
    """Return code and message of the error with which the log is refused."""
    with pytest.raises(InvalidInput) as caught:
        read_log(path)
    (found,) = caught.value.problems
    assert found.path == str(path)
    return f"{found.code} {found.message}"


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda data: b"", "SC801 not a log of simscen: it is not an MCAP file"),
        (lambda data: b"name: goal\nworld: house\n", "SC801 not a log of simscen: it is not an MCAP file"),
        (lambda data: data[:-1], "SC803 the log is truncated: its run was aborted"),
        (lambda data: data[: len(data) // 2], "SC803 the log is truncated: its run was aborted"),
        (lambda data: data[:60], "SC801 not a log of simscen: it has no description of its run"),
    ],
)
def test_file_of_another_type_is_reported(
    tmp_path: Path, log: Path, change: Callable[[bytes], bytes], expected: str
) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(change(log.read_bytes()))
    assert problem(path) == expected


def test_concatenated_logs_are_refused(tmp_path: Path, log: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(2 * log.read_bytes())
    message = "SC802 the log is damaged: data follows its end; a file of several logs cannot be judged"
    assert problem(path) == message


def write_chunked_log(path: Path, compression: CompressionType, data: bytes) -> Path:
    """Write a log with one chunk that contains one message."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=compression)
        writer.start("ros2", "rosbag2")
        channel = writer.register_channel("/odom", "cdr", writer.register_schema("std_msgs/msg/String", "ros2msg", b""))
        writer.add_message(channel, 5, data, 5)
        writer.finish()
    return path


@pytest.mark.parametrize("compression", CompressionType)
def test_chunks_are_read_up_to_a_limit(tmp_path: Path, monkeypatch, compression: CompressionType) -> None:
    path = write_chunked_log(tmp_path / "run.mcap", compression, bytes(10_000))
    monkeypatch.setattr(mcap_reader, "MAX_RECORD_BYTES", 20_000)
    with path.open("rb") as stream:
        (message,) = [record for record in RecordReader(stream) if isinstance(record, Message)]
    assert message.data == bytes(10_000)
    monkeypatch.setattr(mcap_reader, "MAX_RECORD_BYTES", 9_000)
    with path.open("rb") as stream, pytest.raises((ValueError, McapError), match=r"more than|exceeds limit"):
        list(RecordReader(stream))


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    assert problem(tmp_path / "run.mcap") == "SC800 cannot read the log: No such file or directory"


def test_log_of_another_recorder_is_reported(tmp_path: Path) -> None:
    with Path(tmp_path / "run.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "rosbag2")
        schema = writer.register_schema("nav_msgs/msg/Odometry", "ros2msg", b"")
        channel = writer.register_channel("/odom", "cdr", schema)
        writer.add_message(channel, 0, b"", 0)
        writer.finish()
    assert problem(tmp_path / "run.mcap").startswith("SC801 not a log of simscen")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(position=st.floats(0, 1), bit=st.integers(0, 7))
def test_flipped_bit_is_detected(tmp_path: Path, log: Path, position: float, bit: int) -> None:
    data = bytearray(log.read_bytes())
    (summary,) = struct.unpack_from(
        "<Q", data, len(data) - 28
    )  # simscen does not read the index, which follows the summary
    data[int(position * (summary - 1))] ^= 1 << bit
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    assert problem(path)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(kept_fraction=st.floats(0, 1))
def test_truncated_log_is_read_up_to_its_end_or_refused(tmp_path: Path, log: Path, kept_fraction: float) -> None:
    data = log.read_bytes()
    path = tmp_path / "cut.partial.mcap"
    path.write_bytes(data[: int(kept_fraction * len(data))])
    try:
        read: Log | None = read_log(path)
    except InvalidInput:
        read = None
    assert read is None or len(read.trace.truth) <= 41
