from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from simscen.core.time import Clock
from simscen.run.firing import Firing
from simscen.triggers.trigger import Trigger


@dataclass
class Now:
    tick: int
    travelled: float = 0.0
    clock: ClassVar[Clock] = Clock(240)


def firings(trigger: dict, travelled, seed=1):
    firing = Firing(Trigger.model_validate(trigger), np.random.default_rng(seed))
    return [firing.fires(Now(24 * beat, value)) for beat, value in enumerate(travelled)]


def test_a_rising_trigger_fires_once_when_its_condition_becomes_true():
    assert firings({"travelled": 2.0}, [0, 1, 2, 3, 4]) == [0, 0, 1, 0, 0]


def test_a_condition_that_holds_from_the_start_fires_at_the_first_beat():
    assert firings({"time": "0 s"}, [0, 0, 0]) == [1, 0, 0]


def test_a_falling_trigger_fires_when_its_condition_stops_being_true():
    assert firings({"not": {"travelled": 2.0}, "edge": "falling"}, [0, 1, 2, 3]) == [0, 0, 1, 0]


def test_a_falling_trigger_needs_to_have_seen_its_condition_hold():
    assert firings({"travelled": 2.0, "edge": "falling"}, [0, 1, 0, 0]) == [0, 0, 0, 0]


def test_a_trigger_fires_as_often_as_it_may():
    assert firings({"travelled": 1.0, "times": 2}, [0, 1, 0, 1, 0, 1]) == [0, 1, 0, 1, 0, 0]


def test_a_delayed_trigger_fires_later():
    assert firings({"travelled": 1.0, "delay": "200 ms"}, [0, 1, 1, 1, 1]) == [0, 0, 0, 1, 0]


def test_a_probability_is_the_share_of_edges_that_count():
    edges = [0, 1] * 4000
    fired = sum(firings({"travelled": 1.0, "times": 4000, "probability": 0.3}, edges))
    assert fired / 4000 == pytest.approx(0.3, abs=0.03)  # four standard errors


def test_the_same_seed_gives_the_same_chance():
    edges = [0, 1] * 50
    trigger = {"travelled": 1.0, "times": 50, "probability": 0.5}
    assert firings(trigger, edges, seed=3) == firings(trigger, edges, seed=3)
    assert firings(trigger, edges, seed=3) != firings(trigger, edges, seed=4)
