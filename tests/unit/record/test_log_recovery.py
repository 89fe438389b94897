"""Tests of the recovery of the log of an aborted run."""

import os
import signal
from pathlib import Path

import pytest
from foreign_logs import UNINDEXED, drive, write_mcap
from mcap.reader import make_reader
from moments import CLOCK, moments, sample_header

from simscen.core.errors import InvalidInput
from simscen.record.log_reader import read_log
from simscen.record.log_recovery import recover
from simscen.record.moment_buffer import MOMENT_DELAY_S, MomentBuffer
from simscen.record.recorder import Recorder


def messages(path: Path) -> list[tuple[str, int, bytes]]:
    with path.open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_summary() is not None
        return [(channel.topic, message.log_time, message.data) for _, channel, message in reader.iter_messages()]


def log_of_killed_process(folder: Path, seconds: float) -> Path:
    """Return the log of a process that is killed by SIGKILL after `seconds` of simulated time."""
    child = os.fork()
    if child == 0:
        recorder = Recorder(folder / "run.mcap", CLOCK, sample_header())
        for moment in moments(seconds):
            recorder.append(moment)
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    return folder / "run.partial.mcap"


@pytest.fixture
def complete_log(tmp_path: Path) -> Path:
    path = tmp_path / "complete.mcap"
    with Recorder(path, CLOCK, sample_header()) as recorder:
        for moment in moments(5.0):
            recorder.append(moment)
        recorder.close(CLOCK.ticks(5.0))
    return path


def test_log_truncated_anywhere_opens_in_an_indexed_reader(tmp_path: Path, complete_log: Path) -> None:
    expected, size = messages(complete_log), complete_log.stat().st_size
    for kept in (0.9, 0.7, 0.31):
        truncated = tmp_path / "cut.partial.mcap"
        truncated.write_bytes(complete_log.read_bytes()[: int(size * kept)])
        before = read_log(truncated).trace
        assert recover(truncated)
        recovered = messages(truncated)
        assert recovered == expected[: len(recovered)]
        assert not read_log(truncated).complete
        assert read_log(truncated).trace.truth.values.tolist() == before.truth.values.tolist()
        assert not recover(truncated), "a recovered log needs no recovery"
        assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_a_killed_log_keeps_95_percent_for_other_readers(tmp_path: Path, complete_log: Path) -> None:
    truncated = log_of_killed_process(tmp_path, 5.0)
    recover(truncated)
    assert len(messages(truncated)) >= 0.95 * len(messages(complete_log))


@pytest.mark.parametrize("seconds", [0.95, 1.85, 2.75, 4.4])
def test_a_killed_run_loses_at_most_one_simulated_second(tmp_path: Path, seconds: float) -> None:
    child = os.fork()
    if child == 0:  # writes through the buffer that runs use, and never flushes it explicitly
        recorder = Recorder(tmp_path / "run.mcap", CLOCK, sample_header())
        log = MomentBuffer(CLOCK.ticks(MOMENT_DELAY_S), recorder).sink(recorder.robots[""])
        for moment in moments(seconds):
            log.append(moment)
        os.kill(os.getpid(), signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == -signal.SIGKILL
    log_of_killed = read_log(tmp_path / "run.partial.mcap")
    assert not log_of_killed.complete
    assert CLOCK.ticks(seconds) - log_of_killed.trace.end <= CLOCK.ticks(1.0)


def test_aborted_run_leaves_a_readable_log(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), Recorder(tmp_path / "run.mcap", CLOCK, sample_header()) as recorder:
        for moment in moments(1.0):
            recorder.append(moment)
        raise ZeroDivisionError
    partial = tmp_path / "run.partial.mcap"
    assert len(messages(partial)) > 100
    log = read_log(partial)
    assert not log.complete
    assert log.trace.end == CLOCK.ticks(1.0)


def test_truncated_log_of_another_program_is_unchanged(tmp_path: Path) -> None:
    """Recovery would lose encodings, publish times, and sequence numbers."""
    file = write_mcap(tmp_path / "a.mcap", drive(), encoding="json", **UNINDEXED)
    file.write_bytes(file.read_bytes()[: int(0.9 * file.stat().st_size)])
    before = file.read_bytes()
    with pytest.raises(InvalidInput, match="another program recorded it"):
        recover(file)
    assert file.read_bytes() == before
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("content", [b"", b"no log", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + bytes(100)])
def test_file_that_is_not_a_log_is_unchanged(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.partial.mcap"
    path.write_bytes(content)
    with pytest.raises(InvalidInput):
        recover(path)
    assert path.read_bytes() == content
    assert list(tmp_path.iterdir()) == [path]
