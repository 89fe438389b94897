import pytest

from simscen.criteria.timeline import Span, spans
from simscen.testing.synthetic_trace import synthetic_trace

SECOND = 240


def happened(*events):
    kinds = {"+": "fault.started", "-": "fault.ended"}
    listed = [[at, kinds[sign], "lidar.off", {"entry": entry}] for at, sign, entry in events]
    return spans(synthetic_trace({"seconds": 20, "truth": [[0, 0, 0]], "events": listed}), "lidar.off")


def lasted(start, end):
    return Span(start * SECOND, end * SECOND, True)


def to_the_end(start):
    return Span(start * SECOND, 20 * SECOND, False)


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        ([(2, "+", 0), (3, "-", 0)], [lasted(2, 3)]),
        ([(2, "+", 0), (3, "-", 0), (3, "+", 0), (5, "-", 0)], [lasted(2, 3), lasted(3, 5)]),
        ([(2, "+", 0), (4, "+", 1), (6, "-", 1)], [to_the_end(2), lasted(4, 6)]),
        ([(2, "+", 1), (4, "+", 0), (5, "-", 0), (9, "-", 1)], [lasted(2, 9), lasted(4, 5)]),
        (
            [(2, "+", 1), (3, "-", 1), (4, "+", 0), (5, "-", 0), (6, "+", 1), (7, "-", 1)],
            [lasted(2, 3), lasted(4, 5), lasted(6, 7)],
        ),
        ([(2, "+", 0), (2, "-", 0)], [to_the_end(2)]),
    ],
    ids=["once", "again", "another entry's end is not its own", "one within the other", "in turns", "no time"],
)
def test_a_fault_lasts_from_its_own_start_to_its_own_end(events, expected):
    assert happened(*events) == expected
