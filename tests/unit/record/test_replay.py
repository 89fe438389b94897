"""Tests that the trace of a log is bit-identical to the trace of its run."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from any_moments import runs
from hypothesis import given, settings
from hypothesis import strategies as st
from moments import CASE, CLOCK, moments, sample_header

from simscen.core.messages.navigation import Path as Plan
from simscen.core.records.trace import Moment, Samples, Trace
from simscen.record.log_reader import read_log
from simscen.record.recorder import Recorder
from simscen.record.trace_builder import TraceBuilder

HERE = Path(__file__).parent
RESULT = '{"status": "pass"}'


def record_run(path: Path, run: "list[Moment]", end: int) -> Trace:
    """Write the log of a run, and return its trace."""
    builder = TraceBuilder(CLOCK)
    with Recorder(path, CLOCK, sample_header()) as recorder:
        for moment in run:
            recorder.append(moment)
            builder.append(moment)
        recorder.close(end, RESULT)
    return builder.finish(end)


def exact(value: object) -> object:
    """Return a value that is equal only for equal bits: nan equals itself, 0.0 is not -0.0."""
    match value:
        case np.ndarray():
            return value.dtype.str, value.shape, value.tobytes()
        case Samples() | Plan():
            return [exact(getattr(value, field.name)) for field in dataclasses.fields(value)]
        case dict():
            return [(name, exact(item)) for name, item in value.items()]
        case tuple():
            return [exact(item) for item in value]
    return repr(value)


def assert_same(ours: Trace, theirs: Trace) -> None:
    for field in dataclasses.fields(Trace):
        assert exact(getattr(ours, field.name)) == exact(getattr(theirs, field.name)), field.name


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    record_run(path, list(moments(1.0)), 240)
    return path


@pytest.mark.parametrize("seed", range(3))
def test_replayed_log_gives_a_bit_identical_trace(tmp_path: Path, seed: int) -> None:
    trace = record_run(tmp_path / "run.mcap", list(moments(2.0, seed)), 481)
    assert_same(trace, read_log(tmp_path / "run.mcap").trace)


@settings(max_examples=50, deadline=None)
@given(run=runs, remaining_ticks=st.integers(0, 10**7))
def test_any_moments_are_replayed_exactly(
    tmp_path_factory: pytest.TempPathFactory, run: list[Moment], remaining_ticks: int
) -> None:
    path = tmp_path_factory.mktemp("any") / "run.mcap"
    end = remaining_ticks + max((moment.tick for moment in run), default=0)
    assert_same(record_run(path, run, end), read_log(path).trace)


def test_log_contains_the_case_and_facts_of_its_run(log: Path) -> None:
    read, header = read_log(log), sample_header()
    assert read.complete
    assert read.result == RESULT
    for name in ("name", "seed", "case", "scenario", "robot_description", "files", "facts"):
        assert getattr(read.header, name) == getattr(header, name)
    assert read.header.case == CASE
    assert read.header.mounts["camera"] == header.mounts["camera"]


def test_the_map_is_read_back_exactly(log: Path) -> None:
    ours, theirs = read_log(log).header.map, sample_header().map
    assert ours is not None
    assert theirs is not None
    assert exact(ours.cells) == exact(theirs.cells)
    assert (ours.resolution, ours.origin) == (theirs.resolution, theirs.origin)
