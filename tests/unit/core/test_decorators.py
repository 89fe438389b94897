import pickle
from dataclasses import FrozenInstanceError, field, fields, replace

import pytest

from simscen.core.decorators import fast_dataclass


@fast_dataclass()
class Told:
    """Something."""

    name: str
    number: int = 3
    things: dict[str, int] = field(default_factory=dict)


def test_frozen_class_is_created_like_a_dataclass() -> None:
    text = Told("a", things={"b": 1})
    assert (text.name, text.number, text.things) == ("a", 3, {"b": 1})
    assert text == Told(name="a", things={"b": 1}) != Told("a")
    assert repr(Told("a", 4)) == "Told(name='a', number=4, things={})"
    assert replace(text, number=5) == Told("a", 5, {"b": 1})
    assert [each.name for each in fields(Told)] == ["name", "number", "things"]
    assert pickle.loads(pickle.dumps(text)) == text
    with pytest.raises(TypeError):
        Told()  # type: ignore[call-arg]


def test_default_factory_creates_a_value_per_instance() -> None:
    assert Told("a").things is not Told("a").things


def test_instance_is_immutable() -> None:
    with pytest.raises(FrozenInstanceError):
        Told("a").number = 4  # type: ignore[misc]
