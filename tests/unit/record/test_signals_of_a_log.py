"""A named signal is the same, bit for bit, from the run and from its log."""

import pytest
from moments import CASE, CLOCK, about, moments

from simscen.core.records.trace import Trace
from simscen.criteria.trace_signals.catalog import SIGNALS, read_signal
from simscen.criteria.trace_signals.sampling import SignalUnavailable
from simscen.record.log_reader import read_log
from simscen.record.recorder import Recorder
from simscen.record.trace_builder import TraceBuilder

OF = {"object": "cart", "region": "aisle", "fault": "lidar.off", "event": "cart"}


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[Trace, Trace]:
    path, builder = tmp_path_factory.mktemp("log") / "run.mcap", TraceBuilder(CLOCK)
    with Recorder(path, CLOCK, about()) as recorder:
        for moment in moments(3.0):
            recorder.append(moment)
            builder.append(moment)
        recorder.close(720, "{}")
    return builder.finish(720), read_log(path).trace


@pytest.mark.parametrize("name", SIGNALS)
def test_signal_of_a_run_equals_that_of_its_log(name: str, both: tuple[Trace, Trace]) -> None:
    of = {key: OF[key] for key in SIGNALS[name].required_arguments[:1]}
    live, replayed = (_bits(name, trace, of) for trace in both)
    assert live == replayed


def _bits(name: str, trace: Trace, of: dict[str, str]) -> bytes | str:
    try:
        return read_signal(name, trace, CASE, of).tobytes()
    except SignalUnavailable as error:
        return str(error)


def test_most_signals_are_in_the_log(both: tuple[Trace, Trace]) -> None:
    answers = [_bits(name, both[1], {key: OF[key] for key in s.required_arguments[:1]}) for name, s in SIGNALS.items()]
    assert sum(isinstance(answer, bytes) for answer in answers) >= len(SIGNALS) - 1
