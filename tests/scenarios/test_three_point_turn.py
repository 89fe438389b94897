"""Test of the three-point turn of a car."""

from pathlib import Path

import numpy as np

import simscen
from simscen.stack.kinematics import cusps

ROOT = Path(__file__).parents[2]
TURNING_RADIUS = 0.45 / np.tan(0.51)
MIN_SPEED_M_S = 0.03


def test_car_turns_around_on_a_road_that_is_too_narrow_for_a_u_turn():
    run = simscen.simulate(ROOT / "scenarios/robots/car_three_point_turn.scenario.yaml")
    trace = run.trace
    assert run.passed

    assert len(cusps(trace.plans[0].points)) >= 2
    speed, turn = trace.velocity.values[:, 0], trace.velocity.values[:, 2]
    directions = np.sign(speed[np.abs(speed) > MIN_SPEED_M_S])
    assert np.count_nonzero(np.diff(directions)) >= 2, "forward and backward in turns"
    driving = np.abs(speed) > 0.1
    assert (np.abs(turn[driving]) <= np.abs(speed[driving]) / TURNING_RADIUS * 1.1 + 0.05).all()
    is_stationary = np.abs(speed) < 0.01
    assert np.abs(turn[is_stationary]).max() < 0.1, "the car never turns in place"
