"""Tests that objects with precomputed poses are logged like objects whose poses are queried."""

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

PERIOD_TICKS, BATCH_LENGTH = 6, 20
"""Period of the samples, and number of samples in a batch of precomputed poses."""
STATIONARY = {"a shelf": Pose3(1.0, 2.0), "the door": Pose3(3.0, 4.0)}


def precomputed_moments(
    moving: tuple[str, ...], stationary: dict[str, Pose3], pause_probability: float, seed: int, start: int = 0
) -> list[Moment]:
    """Return the moments of four seconds.

    Moving objects pause at each sample with the given probability.
    """
    rng = np.random.default_rng(seed)
    table = rng.uniform(-5, 5, (160, len(moving), 7))
    for moment in range(1, len(table)):
        table[moment] = np.where(rng.random((len(moving), 1)) < pause_probability, table[moment - 1], table[moment])
    initial = dict(sorted({**stationary, **dict.fromkeys(moving, Pose3())}.items()))
    moments = []
    for first in range(0, len(table), BATCH_LENGTH):
        ticks = range(start + first * PERIOD_TICKS, start + (first + BATCH_LENGTH) * PERIOD_TICKS, PERIOD_TICKS)
        batch = PredictedPoses(ticks, moving, table[first : first + BATCH_LENGTH], initial)
        objects_at = [batch.at(tick) for tick in ticks]
        assert all(objects_at)
        assert batch.at(ticks[-1] + 1) is None
        assert batch.at(ticks[-1] + PERIOD_TICKS) is None
        moments += [
            Moment(tick, Truth(Pose3(x=tick / 240), STOP, 1.0, objects), (), Decision(STOP))
            for tick, objects in zip(ticks, objects_at, strict=True)
            if objects is not None and (pause_probability < 0.5 or rng.random() < 0.9)
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


@pytest.mark.parametrize("pause_probability", [0.0, 0.02, 0.7, 1.0])
@pytest.mark.parametrize("stationary", [{}, STATIONARY], ids=["all move", "some stay"])
def test_precomputed_poses_give_the_same_log_as_queried_poses(
    stationary: dict[str, Pose3], pause_probability: float
) -> None:
    precomputed = precomputed_moments(("cart 1", "cart 2", "cart 3"), stationary, pause_probability, seed=3)
    precomputed += precomputed_moments(
        ("cart 1", "cart 3"), stationary, pause_probability, seed=4, start=precomputed[-1].tick + 10 * PERIOD_TICKS
    )
    queried = [replace(m, sample=m.truth and m.truth._replace(objects=dict(m.truth.objects))) for m in precomputed]
    (log, trace), (expected_log, expected) = log_and_trace(precomputed), log_and_trace(queried)
    assert log == expected_log
    assert list(trace.objects) == list(expected.objects) == sorted({*stationary, "cart 1", "cart 2", "cart 3"})
    for name, samples in expected.objects.items():
        assert trace.objects[name].ticks.tolist() == samples.ticks.tolist()
        assert trace.objects[name].values.tolist() == samples.values.tolist()


def test_precomputed_poses_are_a_mapping_in_name_order() -> None:
    table = np.arange(2 * 14.0).reshape(2, 2, 7)
    initial = {"a": Pose3(), "b": Pose3(9.0), "c": Pose3()}
    objects_at = PredictedPoses(range(12, 24, 6), ("a", "c"), table, initial).at(18)
    assert objects_at == {"a": Pose3(*range(14, 21)), "b": Pose3(9.0), "c": Pose3(*range(21, 28))}
    assert objects_at is not None
    assert (list(objects_at), len(objects_at), type(objects_at["a"])) == (["a", "b", "c"], 3, Pose3)
