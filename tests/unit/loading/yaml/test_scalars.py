"""Tests of the types of YAML scalars."""

import math

import pytest

from simscen.loading.yaml.scalars import parse_scalar


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None), ("~", None), ("null", None), ("Null", None),
        ("true", True), ("False", False), ("TRUE", True),
        ("0", 0), ("7", 7), ("-3", -3), ("+4", 4), ("0o17", 15), ("0x1F", 31),
        ("1.5", 1.5), ("-.5", -0.5), ("1.", 1.0), ("1e3", 1000.0), ("2E-2", 0.02),
        (".inf", math.inf), ("-.INF", -math.inf), ("1e400", math.inf),
    ],
)  # fmt: skip
def test_resolves_scalars_of_the_core_schema(text: str, value: object) -> None:
    assert parse_scalar(text) == value
    assert type(parse_scalar(text)) is type(value)


def test_nan_is_a_number() -> None:
    assert math.isnan(float(parse_scalar(".nan") or 0))


@pytest.mark.parametrize(
    "text",
    [
        "yes",
        "no",
        "on",
        "off",
        "y",
        "1:30",
        "012",
        "-007",
        "00.5",
        "1_000",
        "2001-99-99",
        "0b1",
        "-",
        ".",
        "+",
        "1.2.3",
    ],
)
def test_yaml_1_1_special_values_stay_text(text: str) -> None:
    assert parse_scalar(text) == text


@pytest.mark.parametrize("text", ["9" * 5000, "-" + "9" * 20, "0x" + "f" * 30])
def test_too_large_integers_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="integer too large"):
        parse_scalar(text)
