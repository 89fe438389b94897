"""Tests that the signals of a log are bit-identical to the signals of its run."""

import pytest
from moments import CASE, CLOCK, moments, sample_header

from simscen.core.records.trace import Trace
from simscen.criteria.findings import MissingEvidence
from simscen.criteria.trace_signals.catalog import SIGNALS, read_signal
from simscen.record.log_reader import read_log
from simscen.record.recorder import Recorder
from simscen.record.trace_builder import TraceBuilder

NAMES = {"object": "cart", "region": "aisle", "fault": "lidar.off", "event": "cart"}


@pytest.fixture(scope="module")
def traces(tmp_path_factory: pytest.TempPathFactory) -> tuple[Trace, Trace]:
    """The trace of a run, and the trace that is read from its log."""
    path, builder = tmp_path_factory.mktemp("log") / "run.mcap", TraceBuilder(CLOCK)
    with Recorder(path, CLOCK, sample_header()) as recorder:
        for moment in moments(3.0):
            recorder.append(moment)
            builder.append(moment)
        recorder.close(720, "{}")
    return builder.finish(720), read_log(path).trace


@pytest.mark.parametrize("name", SIGNALS)
def test_signal_of_a_run_equals_that_of_its_log(name: str, traces: tuple[Trace, Trace]) -> None:
    arguments = {key: NAMES[key] for key in SIGNALS[name].alternative_arguments[:1]}
    live, replayed = (_bits(name, trace, arguments) for trace in traces)
    assert live == replayed


def _bits(name: str, trace: Trace, arguments: dict[str, str]) -> bytes | str:
    try:
        return read_signal(name, trace, CASE, arguments).tobytes()
    except MissingEvidence as error:
        return str(error)


def test_only_signals_without_data_in_the_run_are_missing(traces: tuple[Trace, Trace]) -> None:
    _, log = traces
    values = [_bits(name, log, {key: NAMES[key] for key in s.alternative_arguments[:1]}) for name, s in SIGNALS.items()]
    missing = [name for name, value in zip(SIGNALS, values, strict=True) if not isinstance(value, bytes)]
    # The moments have no people, and plans without the events that state their reasons.
    assert missing == ["person_distance", "replan_count"]
