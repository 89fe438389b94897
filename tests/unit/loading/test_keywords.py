"""Tests of the selection of scenarios with `-k` and `--tag`."""

from dataclasses import dataclass

import pytest

from simscen.core.errors import NothingSelected, UsageError
from simscen.loading.keywords import keyword_matcher, select
from simscen.model.scenario import ScenarioSpec


@dataclass(frozen=True)
class _Scenario:
    title: str
    spec: ScenarioSpec


def _scenario(id_: str, *tags: str) -> _Scenario:
    data = {"simscen": 1, "world": "w", "robot": {"pose": "p"}, "pass": [{"goals_reached": {}}], "tags": list(tags)}
    return _Scenario(id_, ScenarioSpec.model_validate(data))


SCENARIOS = [
    _scenario("faults/lidar_off", "fault", "lidar"),
    _scenario("faults/slip", "fault"),
    _scenario("Navigation/goal"),
]


def _ids(keyword: str = "", *tags: str) -> list[str]:
    return [scenario.title for scenario in select(SCENARIOS, keyword, tags)]


@pytest.mark.parametrize(
    ("keyword", "expected"),
    [
        ("", "abc"), ("  ", "abc"), ("faults", "ab"), ("FAULTS/LIDAR", "a"), ("navigation", "c"),
        ("lidar or goal", "ac"), ("faults and not lidar", "b"), ("not faults", "c"), ("not (lidar or goal)", "b"),
        ("faults and lidar or goal", "ac"), ("faults and (lidar or goal)", "a"), ("not not lidar", "a"),
    ],
)  # fmt: skip
def test_keywords_read_as_in_pytest(keyword: str, expected: str) -> None:
    assert _ids(keyword) == [SCENARIOS["abc".index(letter)].title for letter in expected]


def test_any_of_the_tags_selects() -> None:
    assert _ids("", "lidar") == ["faults/lidar_off"]
    assert _ids("", "lidar", "fault") == ["faults/lidar_off", "faults/slip"]
    assert _ids("slip", "fault") == ["faults/slip"]


@pytest.mark.parametrize(
    "keyword", ["and", "a and", "or b", "not", "(a", "a)", "a b", "()", "(" * 5000 + "a", "not " * 5000 + "a"]
)
def test_a_broken_expression_is_a_usage_error(keyword: str) -> None:
    with pytest.raises(UsageError, match="cannot read -k"):
        keyword_matcher(keyword)


def test_keyword_expression_executes_no_code() -> None:
    assert not keyword_matcher("__import__('os').system('true')".replace("(", "").replace(")", ""))("x")


@pytest.mark.parametrize(
    ("keyword", "tags", "message"),
    [
        ("nothing", (), "none of 3 scenarios matches -k `nothing`"),
        ("", ("lidr",), "no scenario has the tag `lidr`; did you mean `lidar`"),
        ("goal", ("fault",), "none of 3 scenarios matches -k `goal` and --tag fault"),
    ],
)
def test_empty_selection_is_explained(keyword: str, tags: tuple[str, ...], message: str) -> None:
    with pytest.raises(NothingSelected, match=message):
        select(SCENARIOS, keyword, tags)
