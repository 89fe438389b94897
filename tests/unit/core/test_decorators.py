"""Tests of frozen dataclasses that are fast to create."""

import pickle
from dataclasses import FrozenInstanceError, field, fields, replace

import pytest

from simscen.core.decorators import fast_dataclass


@fast_dataclass()
class Record:
    """Record with a mutable default."""

    name: str
    number: int = 3
    counts: dict[str, int] = field(default_factory=dict)


def test_frozen_class_is_created_like_a_dataclass() -> None:
    record = Record("a", counts={"b": 1})
    assert (record.name, record.number, record.counts) == ("a", 3, {"b": 1})
    assert record == Record(name="a", counts={"b": 1}) != Record("a")
    assert repr(Record("a", 4)) == "Record(name='a', number=4, counts={})"
    assert replace(record, number=5) == Record("a", 5, {"b": 1})
    assert [field_.name for field_ in fields(Record)] == ["name", "number", "counts"]
    assert pickle.loads(pickle.dumps(record)) == record
    with pytest.raises(TypeError):
        Record()  # type: ignore[call-arg]


def test_default_factory_creates_a_value_per_instance() -> None:
    assert Record("a").counts is not Record("a").counts


def test_instance_is_immutable() -> None:
    with pytest.raises(FrozenInstanceError):
        Record("a").number = 4  # type: ignore[misc]
