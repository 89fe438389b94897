"""Tests of the state of triggers: edges, repetition, delay, probability, and duration."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from simscen.core.clock import Clock
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.run.live_world.director import ConditionState, TriggerState
from simscen.testing.fakes import FakeStage
from simscen.triggers.base import Trigger


@dataclass
class Situation:
    tick: int
    travelled: float = 0.0
    clock: ClassVar[Clock] = Clock(240)


def firings(trigger: dict, travelled, seed=1):
    """Return how often the trigger fires at each beat of 24 ticks, given the traveled distance at each beat."""
    state = TriggerState(Trigger.model_validate(trigger), np.random.default_rng(seed))
    return [state.count_firings(Situation(24 * beat, value)) for beat, value in enumerate(travelled)]


def test_a_rising_trigger_fires_once_when_its_condition_becomes_true():
    assert firings({"travelled": 2.0}, [0, 1, 2, 3, 4]) == [0, 0, 1, 0, 0]


def test_a_condition_that_holds_from_the_start_fires_at_the_first_beat():
    assert firings({"time": "0 s"}, [0, 0, 0]) == [1, 0, 0]


def test_a_falling_trigger_fires_when_its_condition_stops_being_true():
    assert firings({"not": {"travelled": 2.0}, "edge": "falling"}, [0, 1, 2, 3]) == [0, 0, 1, 0]


def test_a_falling_trigger_needs_a_condition_that_was_true_before():
    assert firings({"travelled": 2.0, "edge": "falling"}, [0, 1, 0, 0]) == [0, 0, 0, 0]


def test_a_trigger_fires_at_most_the_specified_number_of_times():
    assert firings({"travelled": 1.0, "times": 2}, [0, 1, 0, 1, 0, 1]) == [0, 1, 0, 1, 0, 0]


def test_a_delayed_trigger_fires_later():
    assert firings({"travelled": 1.0, "delay": "200 ms"}, [0, 1, 1, 1, 1]) == [0, 0, 0, 1, 0]


def test_a_probability_is_the_share_of_edges_that_fire():
    edges = [0, 1] * 4000
    fired = sum(firings({"travelled": 1.0, "times": 4000, "probability": 0.3}, edges))
    assert fired / 4000 == pytest.approx(0.3, abs=0.03)  # four standard errors


def test_random_firings_depend_only_on_the_seed():
    edges = [0, 1] * 50
    trigger = {"travelled": 1.0, "times": 50, "probability": 0.5}
    assert firings(trigger, edges, seed=3) == firings(trigger, edges, seed=3)
    assert firings(trigger, edges, seed=3) != firings(trigger, edges, seed=4)


LASTING = {"travelled": 1.0, "for": "300 ms"}  # 72 ticks: three beats


def test_a_condition_with_a_duration_fires_at_the_end_of_the_duration():
    assert firings(LASTING, [0, 1, 1, 1, 1, 1]) == [0, 0, 0, 0, 1, 0]


def test_interruption_resets_the_duration():
    assert firings(LASTING, [0, 1, 1, 1, 0, 1, 1, 1, 1]) == [0, 0, 0, 0, 0, 0, 0, 0, 1]


def test_duration_counts_from_the_start_of_the_run():
    assert firings(LASTING, [1, 1, 1, 1, 1]) == [0, 0, 0, 1, 0]


def test_falling_edge_with_duration_needs_a_lasting_condition():
    falling = {**LASTING, "edge": "falling"}
    assert firings(falling, [0, 1, 1, 1, 1, 1, 0, 0]) == [0, 0, 0, 0, 0, 0, 1, 0]
    assert firings(falling, [0, 1, 1, 1, 0, 0, 0, 0]) == [0] * 8


def test_a_delay_starts_at_the_end_of_the_duration():
    assert firings({**LASTING, "delay": "100 ms"}, [0, 1, 1, 1, 1, 1, 1]) == [0, 0, 0, 0, 0, 1, 0]


FAST, HALL = {"speed_above": 0.5}, {"robot_in": {"region": "hall"}}
COMBINED = {
    "in one of all": ({"all": [{**FAST, "for": "200 ms"}, HALL]}, lambda fast, hall: lasts(fast, 2) & hall),
    "around all": ({"all": [FAST, HALL], "for": "200 ms"}, lambda fast, hall: lasts(fast & hall, 2)),
    "in any": ({"any": [{**FAST, "for": "500 ms"}, {**HALL, "for": "300 ms"}]},
               lambda fast, hall: lasts(fast, 5) | lasts(hall, 3)),
    "in not": ({"not": {**FAST, "for": "200 ms"}, "for": "300 ms"}, lambda fast, hall: lasts(~lasts(fast, 2), 3)),
}  # fmt: skip


def lasts(values, beats):
    """Return for each beat whether the values are true at this beat and the previous `beats` beats."""
    return np.array([k >= beats and values[k - beats : k + 1].all() for k in range(len(values))])


@pytest.mark.parametrize("case", COMBINED)
def test_durations_apply_inside_combined_conditions(case):
    trigger, expected = COMBINED[case]
    rng = np.random.default_rng(5)
    fast, hall = (np.repeat(rng.random(60) < 0.6, rng.integers(1, 9, 60)) for _ in range(2))
    length = min(len(fast), len(hall))
    fast, hall = fast[:length], hall[:length]
    state = ConditionState(Trigger.model_validate(trigger))
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    states = [
        state.holds(
            FakeStage(
                tick=24 * k,
                twist=Twist(1.0 if fast[k] else 0.0),
                robot=Pose2(0.5 if hall[k] else 9.0, 0.5),
                regions={"hall": square},
            )
        )
        for k in range(length)
    ]
    assert states == expected(fast, hall).tolist()
    assert 0 < sum(states) < length


def test_each_edge_fires_after_its_own_delay():
    edges = [0, 1, 0, 1, 0, 0, 0]
    assert firings({"travelled": 1.0, "times": 2, "delay": "400 ms"}, edges) == [0, 0, 0, 0, 0, 1, 0]
    assert firings({"travelled": 1.0, "times": 2, "delay": "400 ms"}, [*edges, 0]) == [0, 0, 0, 0, 0, 1, 0, 1]
