"""The package keeps the promises of its kinds; sensors and metrics that break them are found out."""

from textwrap import dedent

import pytest

from simscen.spec.registry import find, shipped
from simscen.testing import PromiseBroken, promises_of
from simscen.testing.subjects import NoSubject, named

VALUES = {
    ("criterion", "dwell"): {"region": "yard", "max": 2.0},
    ("fault", "crosstalk"): {},
    ("trigger", "reversing"): 0.1,
    ("action", "turn_robot"): {"by": 1.0},
    ("sensor", "sonar"): {},
    ("metric", "reversed_length"): {},
}
HEAD = """\
from typing import ClassVar
import itertools
import numpy as np
from simscen.core.sensing import Bump, Scan
from simscen.criteria.measure import Measure
from simscen.model.robot import SensorSpec
from simscen.spec.base import Spec
COUNT = itertools.count()
"""
METRIC = "class Mine(Spec, Measure):\n    def measure(self, trace, case):\n        "
SENSOR = """\
class Mine(SensorSpec):
    component: ClassVar = 'mine:Device'
    says: ClassVar = 'Scan'
class Device:
    def __init__(self, spec, setting):
        self.setting, self.ranges = setting, np.ones(4)
    def read(self, tick):
        """


@pytest.mark.parametrize(("kind", "name"), VALUES)
def test_what_the_package_adds_keeps_its_promises(yardwork, kind: str, name: str) -> None:
    entry = find(kind, name)
    assert entry is not None
    promises = promises_of(entry.load().model_validate(VALUES[kind, name]), name)
    assert len(promises) >= 2
    for promise in promises:
        promise.check()


@pytest.mark.parametrize("name", [entry.name for entry in shipped("sensor")])
def test_shipped_sensors_keep_the_same_promises(name: str) -> None:
    spec = next(entry for entry in shipped("sensor") if entry.name == name).load().model_validate({})
    for promise in promises_of(spec, name):
        promise.check()


@pytest.mark.parametrize(
    ("kind", "text", "seen"),
    [
        ("metric", "return float(chr(110) + 'an')", "is nan for a drive"),
        ("metric", "return None", "is None for a drive"),
        ("metric", "return next(COUNT) + 0.5", "for the same drive"),
        ("metric", "trace.truth.values[:] = 0; return 1.0", "the trace is not what it was"),
        ("metric", "return trace.nothing", "raises AttributeError"),
        ("sensor", "return Bump('tried', tick, True)", "says Bump, but its specification says Scan"),
        ("sensor", "return Scan('tried', tick, np.random.rand(4), 0., 1., 0., 9.)", "something else of the same turn"),
        ("sensor", "self.ranges[:] = tick; return Scan('tried', tick, self.ranges, 0., 1., 0., 9.)", "handed out"),
    ],
)
def test_for_each_promise_one_that_breaks_it_is_found_out(packages, kind: str, text: str, seen: str) -> None:
    code = {"metric": METRIC, "sensor": SENSOR}[kind] + dedent(text) + "\n"
    packages("mines", "1", {kind: {"mine": "mine:Mine"}}, mine=HEAD + code)
    entry = find(kind, "mine")
    assert entry is not None
    broken = []
    for promise in promises_of(entry.load().model_validate({}), "mine"):
        try:
            promise.check()
        except PromiseBroken as error:
            broken.append(str(error))
    assert any(seen in message for message in broken), broken


@pytest.mark.parametrize(
    ("target", "told"),
    [("reversing=0.1", 3), ("reversing", "e.g. reversing=1.0"), ("dwell=3", "3 is no JSON object")],
)
def test_a_bare_value_is_given_as_it_is_written(yardwork, target: str, told: int | str) -> None:
    if isinstance(told, int):
        assert len(named(target)) == told
        return
    with pytest.raises(NoSubject) as wrong:
        named(target)
    assert told in str(wrong.value)
