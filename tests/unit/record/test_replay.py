"""A log gives back the very Trace that the moments gave."""

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest

from simscen.core.trace import Moment, Samples, Trace
from simscen.record.recorder import Recorder
from simscen.record.replay import read_log
from simscen.record.trace import TraceBuilder

sys.path.insert(0, str(Path(__file__).parent))
from moments import CLOCK, about, moments


def recorded(path: Path, run: "list[Moment]", end: int) -> Trace:
    builder = TraceBuilder(CLOCK)
    with Recorder(path, CLOCK, about()) as recorder:
        for moment in run:
            recorder.append(moment)
            builder.append(moment)
        recorder.close(end, '{"status": "pass"}')
    return builder.finish(end)


def assert_same(ours: Trace, theirs: Trace) -> None:
    for field in dataclasses.fields(Trace):
        a, b = getattr(ours, field.name), getattr(theirs, field.name)
        if isinstance(a, Samples):
            assert_same_samples(a, b)
        elif field.name == "plans":
            assert [p.tick for p in a] == [p.tick for p in b]
            assert all(np.array_equal(p.points, q.points) for p, q in zip(a, b, strict=True))
        elif field.name == "objects":
            assert list(a) == list(b)
            for name in a:
                assert_same_samples(a[name], b[name])
        elif field.name == "scans":
            assert np.array_equal(a, b)
        else:
            assert a == b, field.name


def assert_same_samples(a: Samples, b: Samples) -> None:
    assert a.ticks.dtype == b.ticks.dtype == np.int64
    assert np.array_equal(a.ticks, b.ticks)
    assert a.values.tobytes() == b.values.tobytes()


@pytest.mark.parametrize("seed", range(3))
def test_a_replayed_log_gives_the_very_same_trace(tmp_path: Path, seed: int) -> None:
    trace = recorded(tmp_path / "run.mcap", list(moments(2.0, seed)), 481)
    assert_same(trace, read_log(tmp_path / "run.mcap").trace)
