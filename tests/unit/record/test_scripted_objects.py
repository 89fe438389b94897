"""Tests that objects with precomputed poses are logged like those with queried poses."""

import io
from dataclasses import replace

import numpy as np
import pytest
from moments import CLOCK, sample_header

from simscen.core.geometry import Pose3
from simscen.core.geometry.kinematics import STOP
from simscen.core.geometry.scripted_poses import PredictedPoses
from simscen.core.records.trace import Decision, Moment, Trace, Truth
from simscen.record.recorder import Recorder
from simscen.record.trace_builder import TraceBuilder

EVERY, BATCH = 6, 20
STAYS = {"a shelf": Pose3(1.0, 2.0), "the door": Pose3(3.0, 4.0)}


def predicted(
    moves: tuple[str, ...], stays: dict[str, Pose3], pauses: float, seed: int, start: int = 0
) -> list[Moment]:
    """Return four seconds in which some objects stay, and others move at most moments."""
    rng = np.random.default_rng(seed)
    table = rng.uniform(-5, 5, (160, len(moves), 7))
    for moment in range(1, len(table)):
        table[moment] = np.where(rng.random((len(moves), 1)) < pauses, table[moment - 1], table[moment])
    initial = dict(sorted({**stays, **dict.fromkeys(moves, Pose3())}.items()))
    moments = []
    for first in range(0, len(table), BATCH):
        ticks = range(start + first * EVERY, start + (first + BATCH) * EVERY, EVERY)
        batch = PredictedPoses(ticks, moves, table[first : first + BATCH], initial)
        places = [batch.at(tick) for tick in ticks]
        assert all(places)
        assert batch.at(ticks[-1] + 1) is None
        assert batch.at(ticks[-1] + EVERY) is None
        moments += [
            Moment(tick, Truth(Pose3(x=tick / 240), STOP, 1.0, objects), (), Decision(STOP))
            for tick, objects in zip(ticks, places, strict=True)
            if objects is not None and (pauses < 0.5 or rng.random() < 0.9)
        ]
    return moments


def log_and_trace(moments: list[Moment]) -> tuple[bytes, Trace]:
    stream, end = io.BytesIO(), moments[-1].tick + 1
    recorder = Recorder(stream, CLOCK, sample_header())
    builder = TraceBuilder(CLOCK, recorder.robots[""].thinning)
    for moment in moments:
        recorder.append(moment)
        builder.append(moment)
    recorder.close(end)
    return stream.getvalue(), builder.finish(end)


@pytest.mark.parametrize("pauses", [0.0, 0.02, 0.7, 1.0])
@pytest.mark.parametrize("stays", [{}, STAYS], ids=["all move", "some stay"])
def test_precomputed_poses_give_the_same_log_as_queried_poses(stays: dict[str, Pose3], pauses: float) -> None:
    precomputed = predicted(("cart 1", "cart 2", "cart 3"), stays, pauses, seed=3)
    precomputed += predicted(("cart 1", "cart 3"), stays, pauses, seed=4, start=precomputed[-1].tick + 10 * EVERY)
    queried = [replace(m, sample=m.truth and m.truth._replace(objects=dict(m.truth.objects))) for m in precomputed]
    (log, trace), (expected_log, expected) = log_and_trace(precomputed), log_and_trace(queried)
    assert log == expected_log
    assert list(trace.objects) == list(expected.objects) == sorted({*stays, "cart 1", "cart 2", "cart 3"})
    for name, samples in expected.objects.items():
        assert trace.objects[name].ticks.tolist() == samples.ticks.tolist()
        assert trace.objects[name].values.tolist() == samples.values.tolist()


def test_precomputed_poses_are_a_mapping_in_name_order() -> None:
    table = np.arange(2 * 14.0).reshape(2, 2, 7)
    initial = {"a": Pose3(), "b": Pose3(9.0), "c": Pose3()}
    places = PredictedPoses(range(12, 24, 6), ("a", "c"), table, initial).at(18)
    assert places == {"a": Pose3(*range(14, 21)), "b": Pose3(9.0), "c": Pose3(*range(21, 28))}
    assert places is not None
    assert (list(places), len(places), type(places["a"])) == (["a", "b", "c"], 3, Pose3)
