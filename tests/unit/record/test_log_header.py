"""Tests of the header of a log."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from moments import CASE, sample_header

from simscen.core.clock import Clock
from simscen.core.geometry import Pose2
from simscen.core.records.case import Case
from simscen.record import log_header
from simscen.record.log_header import LogHeader


def refuse(constant: str) -> float:
    raise AssertionError(f"{constant} is not JSON")


def test_a_case_is_read_back_equal_with_infinite_distances() -> None:
    assert log_header.case_from_json(log_header.case_to_json(CASE)) == CASE


@given(st.floats(allow_nan=False), st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_of_a_case_are_read_back_exactly(shortest: float, x: float) -> None:
    case = Case(Pose2(x, 0.0), (), {"a": shortest}, time_limit=x)
    decoded = log_header.case_from_json(log_header.case_to_json(case))
    assert repr(decoded.start.x) == repr(decoded.time_limit) == repr(x)
    assert repr(decoded.shortest["a"]) == repr(shortest)


def test_a_case_is_written_as_strict_json() -> None:
    json.loads(log_header.case_to_json(CASE), parse_constant=refuse)


def test_invalid_cases_are_refused() -> None:
    with pytest.raises(ValueError, match="not a case"):
        log_header.case_from_json('{"start": "here"}')


def test_facts_of_a_run_are_kept_apart_from_other_metadata() -> None:
    facts = log_header.run_metadata(sample_header(), Clock(240))
    assert facts["seed"] == "7"
    assert log_header.extra_facts(facts) == {"simscen": "0.1.0"}


def test_attached_file_cannot_replace_an_attachment_of_the_log() -> None:
    with pytest.raises(ValueError, match=r"case\.json"):
        log_header.attachments(LogHeader("a", 1, Case(Pose2(0, 0), ()), files={"case.json": b""}))


@pytest.mark.parametrize(
    ("name", "expected"),
    [("map.pgm", "image/x-portable-graymap"), ("a/b.json", "application/json"), ("x", "application/octet-stream")],
)
def test_media_types_are_determined_by_suffix(name: str, expected: str) -> None:
    assert log_header.media_type(name) == expected
