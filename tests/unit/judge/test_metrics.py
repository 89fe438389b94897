"""Metrics against closed forms, with peers' bugs as cases."""

import math

import numpy as np
import pytest

from simscen.judge.metrics import measure
from simscen.judge.sketch import sketch, sketch_case

GOAL = {"goals": [{"name": "a", "pose": [3, 4, 0]}], "shortest": {"a": 5.0}}
ARRIVED = [[1, "goal.accepted", "a"], [9, "goal.reached", "a"]]


def test_a_detour_halves_spl_when_it_doubles_the_way():
    truth = [[0, 0, 0], [2, 3, 0], [4, 3, 4], [5, 3, 5.5], [6, 3, 4], [10, 3, 4]]
    metrics = measure(sketch({"seconds": 10, "truth": truth, "events": ARRIVED}), sketch_case(GOAL))
    assert metrics["success"] == 1.0
    assert metrics["path_length"] == pytest.approx(10.0, abs=0.02)
    assert metrics["spl"] == metrics["soft_spl"] == pytest.approx(0.5, abs=0.001)
    assert metrics["time_to_goal"] == 8.0


def test_a_failure_has_no_spl_but_keeps_the_share_of_the_way_it_made():
    metrics = measure(sketch({"seconds": 10, "truth": [[0, 0, 0], [8, 1.5, 2], [10, 1.5, 2]]}), sketch_case(GOAL))
    assert metrics["success"] == 0.0
    assert metrics["spl"] == 0.0
    assert metrics["soft_spl"] == pytest.approx(0.5)
    assert metrics["time_to_goal"] is None


@pytest.mark.parametrize("shortest", [{}, {"a": math.inf}, {"a": 0.0}])
def test_spl_is_left_out_when_no_shortest_way_is_known(shortest):
    metrics = measure(sketch({"seconds": 1, "truth": [[0, 0, 0]]}), sketch_case({**GOAL, "shortest": shortest}))
    assert metrics["spl"] is metrics["soft_spl"] is metrics["path_ratio"] is None


def test_turning_through_pi_is_a_small_change_of_heading():
    truth = [[0, 0, 0, 3.1], [1, 0, 0, 3.2], [2, 0, 0, 3.1]]
    assert measure(sketch({"seconds": 2, "truth": truth}), sketch_case({}))["heading_change"] == pytest.approx(0.2)


def test_spinning_to_the_right_is_not_standing():
    truth = [[0, 0, 0, 0], [2, 0, 0, -3], [6, 0, 0, -3]]
    metrics = measure(sketch({"seconds": 6, "truth": truth}), sketch_case({}))
    assert metrics["time_standing"] == pytest.approx(4.0, abs=0.026)


def test_two_contacts_at_once_last_as_long_as_their_union():
    events = [
        [1, "collision.started", "a"],
        [2, "collision.started", "b"],
        [3, "collision.ended", "a"],
        [4, "collision.ended", "b"],
        [9, "collision.started", "a"],
    ]
    metrics = measure(sketch({"seconds": 10, "truth": [[0, 0, 0]], "events": events}), sketch_case({}))
    assert metrics["collisions"] == 3.0
    assert metrics["contact_time"] == 4.0


def test_nees_of_errors_drawn_from_the_covariance_is_three():
    chance = np.random.default_rng(5)
    belief = [[k / 10, *chance.normal(0, 0.1, 3)] for k in range(3001)]
    metrics = measure(sketch({"seconds": 300, "truth": [[0, 0, 0]], "belief": belief}), sketch_case({}))
    assert metrics["nees"] == pytest.approx(3.0, abs=0.2)
    assert metrics["localization_rmse"] == pytest.approx(0.1 * math.sqrt(2), rel=0.05)


def test_a_run_without_belief_has_no_localization():
    metrics = measure(sketch({"seconds": 1, "truth": [[0, 0, 0]], "belief": None}), sketch_case({}))
    assert metrics["localization_rmse"] is metrics["nees"] is None
