"""Tests of sampled values: reproducible, correctly distributed, and independent."""

import math
from statistics import NormalDist, mean
from typing import Any

import pytest

from simscen.loading.variations.sampling import probability, quantile
from simscen.model.variations import Sampled


def draw_values(sampled: Sampled, path: str) -> list[Any]:
    return [quantile(sampled.values[path], probability(sampled, path, index)) for index in range(sampled.count)]


def drawn_values(draw: dict[str, Any], count: int = 400, **options: Any) -> list[Any]:
    return draw_values(Sampled.model_validate({"count": count, "values": {"x": draw}, **options}), "x")


def test_values_do_not_depend_on_the_count_or_on_other_paths() -> None:
    five_values, all_values = drawn_values({"uniform": [0, 1]}, 5), drawn_values({"uniform": [0, 1]}, 50)
    assert all_values[:5] == five_values
    two_paths = Sampled.model_validate({"count": 5, "values": {"y": {"uniform": [0, 1]}, "x": {"uniform": [0, 1]}}})
    assert draw_values(two_paths, "x") == five_values
    assert draw_values(two_paths, "y") != five_values


def test_another_seed_gives_other_draws() -> None:
    assert drawn_values({"uniform": [0, 1]}, seed=2) != drawn_values({"uniform": [0, 1]})


def test_the_draws_are_the_same_on_every_machine() -> None:
    assert drawn_values({"uniform": [0, 1]}, 3) == [0.119164, 0.583385, 0.788349]


def test_uniform_values_fill_their_range_evenly() -> None:
    values = drawn_values({"uniform": [2, 4]}, 1000)
    assert 2 <= min(values) < 2.01
    assert 3.99 < max(values) <= 4
    assert abs(mean(values) - 3) < 0.06


def test_each_order_of_magnitude_is_as_likely_as_the_other() -> None:
    values = [math.log10(value) for value in drawn_values({"log_uniform": [0.001, 1]}, 1000)]
    assert min(values) >= -3
    assert max(values) <= 0
    assert abs(mean(values) + 1.5) < 0.1


def test_normal_values_have_their_mean_and_spread_and_keep_their_bounds() -> None:
    spread = NormalDist.from_samples(drawn_values({"normal": {"mean": 5, "std": 2}}, 1000))
    assert abs(spread.mean - 5) < 0.2
    assert abs(spread.stdev - 2) < 0.15
    bounded = drawn_values({"normal": {"mean": 5, "std": 2, "min": 4, "max": 8}}, 1000)
    assert 4 <= min(bounded) < 4.1
    assert 7.8 < max(bounded) <= 8


def test_integers_and_choices_come_all() -> None:
    assert set(drawn_values({"integer": [1, 6]})) == {1, 2, 3, 4, 5, 6}
    assert set(drawn_values({"choice": ["a", "b"]})) == {0, 1}


@pytest.mark.parametrize("count", [1, 7, 200])
def test_a_latin_hypercube_has_one_value_in_each_part_of_the_range(count: int) -> None:
    values = drawn_values({"uniform": [0, 1]}, count, method="latin_hypercube")
    assert sorted(math.floor(value * count - 1e-6) for value in values) == list(range(count))
    assert count < 3 or values != sorted(values)


def test_a_value_has_the_unit_of_its_range_and_is_in_si_where_there_are_several() -> None:
    assert all(
        value.endswith(" cm") and 10 <= float(value[:-3]) <= 20
        for value in drawn_values({"uniform": ["10 cm", "20 cm"]})
    )
    mixed = drawn_values({"uniform": ["50 cm", "1 m"]})
    assert 0.5 <= min(mixed) <= max(mixed) <= 1


@pytest.mark.parametrize(
    ("draw", "text"),
    [
        ({"uniform": [2, 1]}, "the range is empty: 2 is greater than 1"),
        ({"uniform": ["1 m", "2 s"]}, "`m` and `s` are units of different dimensions"),
        ({"log_uniform": [0, 1]}, "must be greater than 0"),
        ({"integer": [2, 1]}, "the range is empty"),
        ({"normal": {"mean": 0, "std": 0}}, "`std` must be greater than 0"),
        ({"normal": {"mean": 0, "std": 1, "min": 2, "max": 1}}, "`min` 2 is not less than `max` 1"),
        ({"normal": {"mean": 0, "std": 1, "min": 20}}, "too many `std` away"),
    ],
)
def test_invalid_range_is_refused(draw: dict[str, Any], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        drawn_values(draw)
