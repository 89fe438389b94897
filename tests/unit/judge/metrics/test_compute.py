"""Tests of metrics against closed forms, published values, evo, and filterpy; some cases are bugs of other tools."""

import math
from dataclasses import replace

import numpy as np
import pytest
from filterpy import stats

from simscen.core.messages.navigation import Path
from simscen.core.records.trace import Samples
from simscen.criteria.trace_signals.sparc_ldlj import ldlj, sparc
from simscen.judge.metrics.catalog import METRICS
from simscen.judge.metrics.compute import barn_score, compute_metrics
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

NEES = getattr(stats, "NEES", None) or stats.NESS  # as filterpy 1.4.5 misspells it
GOAL = {"goals": [{"name": "a", "pose": [3, 4, 0]}], "shortest": {"a": 5.0}}
ARRIVAL = [[1, "goal.accepted", "a"], [9, "goal.reached", "a"]]
STEP_S = 6 / 240


def metric_values(trace_keys, case=None):
    return compute_metrics(synthetic_trace(trace_keys), synthetic_case(case or {})).values


def circle(radius, seconds=20, turns=1.0):
    """Return waypoints of full circles at constant speed."""
    count = round(seconds / STEP_S)
    angles = np.linspace(0, 2 * math.pi * turns, count + 1)
    return [[k * STEP_S, radius * math.cos(a), radius * math.sin(a), a + math.pi / 2] for k, a in enumerate(angles)]


def trace_with_speeds(speeds):
    trace = synthetic_trace({"seconds": (len(speeds) - 1) * STEP_S, "truth": [[0, 0, 0]]})
    zero = np.zeros(len(speeds))
    return replace(trace, velocity=Samples(trace.truth.ticks, np.column_stack((speeds, zero, zero))))


def test_every_metric_of_the_table_has_a_number_or_a_reason():
    for trace_keys, case in (
        ({"seconds": 0, "truth": [[0, 0, 0]], "belief": None}, {}),
        ({"seconds": 10, "truth": circle(2, 10), "events": ARRIVAL}, GOAL),
    ):
        measures = compute_metrics(synthetic_trace(trace_keys), synthetic_case(case))
        assert list(measures.values) == list(METRICS)
        assert {name for name, value in measures.values.items() if value is None} == set(measures.undefined)
        assert all(measures.undefined.values())


def test_stationary_robot_has_no_smoothness_with_a_reason():
    measures = compute_metrics(synthetic_trace({"seconds": 10, "truth": [[0, 0, 0]]}), synthetic_case({}))
    assert measures.undefined["sparc"] == measures.undefined["ldlj"] == "the robot never moved"
    assert measures.undefined["aol"] == "the robot never drove"
    assert "path is too short" in measures.undefined["max_curvature"]
    assert measures.values["time_not_moving"] == pytest.approx(10.0)
    assert measures.values["max_jerk"] == 0.0


# -- path


def test_detour_that_doubles_the_path_halves_spl():
    truth = [[0, 0, 0], [2, 3, 0], [4, 3, 4], [5, 3, 5.5], [6, 3, 4], [10, 3, 4]]
    metrics = metric_values({"seconds": 10, "truth": truth, "events": ARRIVAL}, GOAL)
    assert metrics["success"] == 1.0
    assert metrics["path_length"] == pytest.approx(10.0, abs=0.02)
    assert metrics["shortest_length"] == 5.0
    assert metrics["path_length_ratio"] == pytest.approx(2.0, abs=0.005)
    assert metrics["spl"] == metrics["soft_spl"] == pytest.approx(0.5, abs=0.001)
    assert metrics["time_to_goal"] == 8.0


def test_path_shorter_than_the_shortest_has_spl_1():
    metrics = metric_values({"seconds": 10, "truth": [[0, 0, 0], [8, 2.8, 4]], "events": ARRIVAL}, GOAL)
    assert metrics["spl"] == 1.0
    assert metrics["soft_spl"] == pytest.approx(1 - 0.2 / 5)


def test_failed_run_has_spl_0_and_soft_spl_for_its_progress():
    metrics = metric_values({"seconds": 10, "truth": [[0, 0, 0], [8, 1.5, 2], [10, 1.5, 2]]}, GOAL)
    assert metrics["success"] == metrics["spl"] == metrics["barn_score"] == 0.0
    assert metrics["soft_spl"] == pytest.approx(0.5)
    assert metrics["time_to_goal"] is None


def test_robot_farther_from_its_goal_than_at_the_start_has_soft_spl_0():
    assert metric_values({"seconds": 10, "truth": [[0, 0, 0], [8, -3, -4]]}, GOAL)["soft_spl"] == 0.0


def test_run_with_collision_has_no_spl():
    touched = [*ARRIVAL, [5, "collision.started", "wall"]]
    metrics = metric_values({"seconds": 10, "truth": [[0, 0, 0], [8, 3, 4]], "events": touched}, GOAL)
    assert metrics["success"] == metrics["spl"] == metrics["barn_score"] == 0.0
    assert metrics["collisions"] == 1.0


@pytest.mark.parametrize("shortest", [{}, {"a": math.inf}, {"a": 0.0}])
def test_spl_is_undefined_without_a_shortest_path(shortest):
    measures = compute_metrics(
        synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]}), synthetic_case({**GOAL, "shortest": shortest})
    )
    for name in ("spl", "soft_spl", "path_length_ratio", "barn_score", "shortest_length"):
        assert measures.values[name] is None
        assert "shortest path" in measures.undefined[name]


def test_kidnapping_adds_no_path_length_and_no_heading_change():
    truth = [[0, 0, 0, 0], [2, 1, 0, 0], [2.025, 9, 0, 3], [4, 10, 0, 3]]
    metrics = metric_values({"seconds": 4, "truth": truth, "events": [[2, "robot.placed"]]})
    assert metrics["path_length"] == pytest.approx(2.0, abs=0.02)
    assert metrics["heading_change"] == metrics["aol"] == metrics["norm_curvature"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("radius", [1.0, 2.0])
def test_circle_has_curvature_of_one_over_radius(radius):
    metrics = metric_values({"seconds": 20, "truth": circle(radius)})
    assert metrics["path_length"] == pytest.approx(2 * math.pi * radius, rel=1e-3)
    assert metrics["heading_change"] == pytest.approx(2 * math.pi)
    assert metrics["aol"] == pytest.approx(1 / radius, rel=0.01)
    assert metrics["max_curvature"] == pytest.approx(1 / radius, rel=1e-3)
    assert metrics["norm_curvature"] == pytest.approx(4 * math.pi, rel=0.12)


def test_straight_line_has_no_curvature_even_back_and_forth():
    metrics = metric_values({"seconds": 20, "truth": [[0, 0, 0], [10, 5, 0], [20, 0, 0]]})
    assert metrics["max_curvature"] == metrics["norm_curvature"] == 0.0
    assert metrics["aol"] == pytest.approx(math.pi / 10, rel=0.01)
    assert metrics["heading_change"] == 0.0


def test_points_nearer_than_30_cm_do_not_affect_curvature():
    shaky = [[k / 10, k * 0.05, 0.02 * (k % 2)] for k in range(101)]
    metrics = metric_values({"seconds": 10, "truth": shaky})
    assert metrics["max_curvature"] < 0.5
    assert metrics["aol"] > 5.0


def test_heading_change_across_pi_is_small():
    """Arena's get_metrics.py does not wrap it, and adds yaw to meters in the path length."""
    truth = [[0, 0, 0, 3.1], [1, 0, 0, 3.2], [2, 0, 0, 3.1]]
    metrics = metric_values({"seconds": 2, "truth": truth})
    assert metrics["heading_change"] == pytest.approx(0.2)
    assert metrics["path_length"] == 0.0


def test_irregularity_is_the_turning_beyond_the_first_plan_to_each_goal():
    """HuNavSim leaves it unimplemented (`pass`)."""
    trace_keys = {"seconds": 20, "truth": circle(2), "events": [[1, "goal.accepted", "a"]]}
    bent = Path(np.array([[0, 0, 0.0], [1, 0, 3.0], [1, 1, -3.0], [2, 1, -3.0]]), 250)
    other = Path(np.array([[0, 0, 0.0], [1, 0, 1.0]]), 900)
    early = Path(np.array([[0, 0, 0.0], [1, 0, 2.0]]), 100)
    trace = replace(synthetic_trace(trace_keys), plans=(early, bent, other))
    turned = 3.0 + (2 * math.pi - 6.0)
    assert compute_metrics(trace, synthetic_case(GOAL)).values["path_irregularity"] == pytest.approx(
        2 * math.pi - turned
    )
    straight = replace(trace, truth=synthetic_trace({"seconds": 20, "truth": [[0, 0, 0], [20, 9, 0]]}).truth)
    assert compute_metrics(straight, synthetic_case(GOAL)).values["path_irregularity"] == 0.0
    unplanned = compute_metrics(replace(trace, plans=(early,)), synthetic_case(GOAL))
    assert "no plan" in unplanned.undefined["path_irregularity"]


# -- BARN


@pytest.mark.parametrize(("seconds", "expected"), [(1.0, 0.5), (12.0, 0.5), (24.0, 0.25), (48.0, 0.125), (99.0, 0.125)])
def test_barn_score_is_half_at_twice_the_optimal_time_or_less(seconds, expected):
    assert barn_score(True, seconds, 12.0) == pytest.approx(expected)


def test_run_without_arrival_has_score_zero():
    assert barn_score(False, 7.0, 12.0) == 0.0


def test_reference_path_of_negative_length_gives_no_score():
    """BARN's run.py takes -31 m in its dynamic branch: every success scores 0.125, after 12 s or after 99 s."""
    for length in (-31.0, 0.0, math.nan):
        with pytest.raises(ValueError, match="reference path"):
            barn_score(True, 12.0, length)
    assert barn_score(True, 15.0, 31.0) > barn_score(True, 99.0, 31.0) > 0.125


def test_only_runs_with_one_goal_have_a_score():
    metrics = metric_values({"seconds": 10, "truth": [[0, 0, 0], [8, 3, 4]], "events": ARRIVAL}, GOAL)
    assert metrics["barn_score"] == pytest.approx(2.5 / 8.0)
    two = {"goals": [*GOAL["goals"], {"name": "b", "pose": [3, 4, 0]}], "shortest": {"a": 5.0, "b": 1.0}}
    measures = compute_metrics(synthetic_trace({"seconds": 10, "truth": [[0, 0, 0]]}), synthetic_case(two))
    assert "one goal" in measures.undefined["barn_score"]


# -- motion


def test_spinning_to_the_right_is_not_stationary():
    """HuNavSim's abs(r.angular_vel < 0.02) counts any turn to the right as stationary."""
    truth = [[0, 0, 0, 0], [2, 0, 0, -3], [6, 0, 0, -3]]
    assert metric_values({"seconds": 6, "truth": truth})["time_not_moving"] == pytest.approx(4.0, abs=0.026)


@pytest.mark.parametrize(
    ("speed", "turn", "is_stationary"),
    [(0.009, 0.019, True), (0.01, 0.0, False), (-0.01, 0.0, False), (0.0, 0.02, False), (0.0, -0.02, False)],
)
def test_definition_of_not_moving(speed, turn, is_stationary):
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]})
    trace = replace(trace, velocity=Samples(trace.truth.ticks, np.tile([speed, 0.0, turn], (41, 1))))
    assert compute_metrics(trace, synthetic_case({})).values["time_not_moving"] == (1.0 if is_stationary else 0.0)


def test_trapezoidal_speed_has_jerk_at_its_corners():
    speeds = np.interp(np.arange(81) * STEP_S, [0, 0.5, 1.5, 2], [0, 1, 1, 0])
    metrics = compute_metrics(trace_with_speeds(speeds), synthetic_case({})).values
    assert metrics["max_jerk"] == pytest.approx(2 / STEP_S)
    assert metrics["mean_jerk"] == pytest.approx(2 * (2 / STEP_S) / 81)
    assert metrics["max_speed"] == 1.0


def test_sparc_and_ldlj_equal_the_published_values():
    movement = np.exp(-5 * np.arange(-1, 1, 0.01) ** 2)
    assert f"{sparc(movement, 100.0):.5f}" == "-1.41403"
    assert f"{ldlj(movement, 100.0):.5f}" == "-5.81636"


def test_smoothness_is_computed_from_the_true_speed_at_its_sampling_rate():
    speeds = np.sin(np.linspace(0, math.pi, 201))
    metrics = compute_metrics(trace_with_speeds(-speeds), synthetic_case({})).values
    assert metrics["sparc"] == sparc(speeds, 40.0)
    assert metrics["ldlj"] == ldlj(speeds, 40.0)


def trapezoid(seconds, wobble=0.0, stop=False):
    times = np.arange(round(seconds * 40) + 1) / 40
    speeds = np.interp(times, [0, 1, seconds - 1, seconds], [0, 0.5, 0.5, 0])
    if stop:
        speeds = np.minimum(speeds, np.interp(np.abs(times - seconds / 2), [1.0, 1.5], [0, 9]))
    return speeds * (1 + wobble * np.sin(2 * math.pi * times))


def test_sparc_detects_oscillation_and_ldlj_detects_stops():
    plain, wobbling, stopping = trapezoid(20), trapezoid(20, wobble=0.2), trapezoid(20, stop=True)
    assert sparc(plain, 40.0) - sparc(wobbling, 40.0) > 0.5
    assert abs(sparc(plain, 40.0) - sparc(stopping, 40.0)) < 0.5
    assert ldlj(plain, 40.0) - ldlj(stopping, 40.0) > 0.5


@pytest.mark.parametrize("speeds", [[], [0.0, 0.0, 0.0, 0.0], [1.0]])
def test_smoothness_is_not_defined_without_motion(speeds):
    assert sparc(np.array(speeds), 40.0) is None
    assert ldlj(np.array(speeds), 40.0) is None


def test_constant_speed_has_no_ldlj_with_a_reason():
    measures = compute_metrics(trace_with_speeds(np.full(81, 0.5)), synthetic_case({}))
    assert measures.values["ldlj"] is None
    assert measures.undefined["ldlj"] == "the speed never changed"
    assert measures.values["sparc"] < 0


# -- surroundings


def test_minimum_and_mean_clearance_are_reported():
    metrics = metric_values({"seconds": 2, "truth": [[0, 0, 0]], "clearance": [[0, 1.5], [2, 0.5]]})
    assert metrics["min_clearance"] == 0.5
    assert metrics["mean_clearance"] == pytest.approx(1.0)
    assert metric_values({"seconds": 2, "truth": [[0, 0, 0]], "clearance": 7.0})["mean_clearance"] == 2.0


def test_two_contacts_at_once_last_as_long_as_their_union():
    events = [
        [1, "collision.started", "a"],
        [2, "collision.started", "b"],
        [3, "collision.ended", "a"],
        [4, "collision.ended", "b"],
        [9, "collision.started", "a"],
    ]
    metrics = metric_values({"seconds": 10, "truth": [[0, 0, 0]], "events": events})
    assert metrics["collisions"] == 3.0
    assert metrics["contact_time"] == 4.0


# -- localization


def trace_of_lost_robot(seconds=60.0, seed=4):
    """Return the trace of a curved drive with a belief that wanders around the truth."""
    rng = np.random.default_rng(seed)
    trace = synthetic_trace({"seconds": seconds, "truth": circle(3, seconds, turns=2)})
    values = trace.belief.values.copy()
    ticks = trace.belief.ticks
    yaw = np.interp(ticks, trace.truth.ticks, np.unwrap(trace.truth.values[:, 2]))
    values[:, :2] = trace.truth.at(ticks)[:, :2] + rng.normal(0, 0.1, (len(ticks), 2))
    values[:, 2] = (yaw + rng.normal(0, 0.2, len(ticks)) + math.pi) % (2 * math.pi) - math.pi
    return replace(trace, belief=Samples(ticks, values))


def evo_trajectory(poses):
    from evo.core.trajectory import PosePath3D

    matrices = [np.eye(4) for _ in poses]
    for matrix, (x, y, yaw) in zip(matrices, poses, strict=True):
        matrix[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
        matrix[:2, 3] = x, y
    return PosePath3D(poses_se3=matrices)


@pytest.mark.parametrize("ours", ["ape_trans", "ape_rot", "rpe_trans", "rpe_rot"])
def test_pose_errors_equal_those_of_evo_without_alignment(ours):
    evo = pytest.importorskip("evo.core.metrics", reason="evo asks for newer packages than make test-lowest has")
    kind, part = ours.split("_")
    relation = {"trans": evo.PoseRelation.translation_part, "rot": evo.PoseRelation.rotation_angle_rad}[part]
    absolute = kind == "ape"
    theirs = evo.APE(relation) if absolute else evo.RPE(relation, 1.0, evo.Unit.meters, pairs_from_reference=True)
    trace = trace_of_lost_robot()
    reference = evo_trajectory(trace.truth.at(trace.belief.ticks)[:, :3])
    theirs.process_data((reference, evo_trajectory(trace.belief.values[:, :3])))
    expected, metrics = theirs.get_all_statistics(), compute_metrics(trace, synthetic_case({})).values
    for name in ("rmse", "mean", "median", "max"):
        assert metrics[f"{ours}_{name}"] == pytest.approx(expected[name], abs=1e-7), name


def test_final_error_is_that_of_the_last_sample():
    metrics = metric_values({"seconds": 10, "truth": [[0, 0, 0]], "belief": [[0, 0, 0], [10, 3, 4]]})
    assert metrics["ape_trans_final"] == metrics["ape_trans_max"] == pytest.approx(5.0)
    assert metrics["ape_trans_median"] == pytest.approx(2.5)


def test_short_drive_has_no_relative_error_with_a_reason():
    measures = compute_metrics(synthetic_trace({"seconds": 10, "truth": [[0, 0, 0], [10, 0.9, 0]]}), synthetic_case({}))
    assert measures.undefined["rpe_trans_rmse"] == measures.undefined["rpe_rot_max"] == "the robot drove less than 1 m"


def test_nees_is_that_of_filterpy():
    trace, rng = trace_of_lost_robot(), np.random.default_rng(9)
    true, values = trace.truth.at(trace.belief.ticks), trace.belief.values.copy()
    squares = rng.normal(size=(len(values), 3, 3))
    covariances = squares @ squares.transpose(0, 2, 1) + 0.05 * np.eye(3)
    values[:, 3:9] = covariances[(slice(None), *np.triu_indices(3))]
    errors = values[:, :3] - true
    errors[:, 2] = (errors[:, 2] + math.pi) % (2 * math.pi) - math.pi
    expected = np.mean(NEES(errors, np.zeros_like(errors), covariances))
    found = compute_metrics(replace(trace, belief=Samples(trace.belief.ticks, values)), synthetic_case({})).values[
        "nees"
    ]
    assert found == pytest.approx(expected)


def test_nees_of_errors_drawn_from_the_covariance_is_three():
    rng = np.random.default_rng(5)
    belief = [[k / 10, *rng.normal(0, 0.1, 3)] for k in range(3001)]
    metrics = metric_values({"seconds": 300, "truth": [[0, 0, 0]], "belief": belief})
    assert metrics["nees"] == pytest.approx(3.0, abs=0.2)
    assert metrics["ape_trans_rmse"] == pytest.approx(0.1 * math.sqrt(2), rel=0.05)


@pytest.mark.parametrize(
    "covariance", [[0, 0, 0, 1, 0, 1], [1, 1, 0, 1, 0, 1], [1, 0, 1, 1, 0, 1], [1, 0, 0, 1, 0, 0], [0, 0, 0, 0, 0, 0]]
)
def test_singular_covariance_is_reported_as_overconfident(covariance):
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]], "belief": {"offset": [0.1, 0, 0]}})
    values = trace.belief.values.copy()
    values[3, 3:9] = covariance
    measures = compute_metrics(replace(trace, belief=Samples(trace.belief.ticks, values)), synthetic_case({}))
    assert measures.values["nees"] is None
    assert "overconfident" in measures.undefined["nees"]


def test_run_without_belief_has_no_localization_metrics():
    measures = compute_metrics(
        synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]], "belief": None}), synthetic_case({})
    )
    assert measures.values["ape_trans_rmse"] is measures.values["nees"] is None
    assert measures.undefined["nees"] == "the robot never reported an estimated pose"


def test_nan_in_a_signal_makes_only_its_metrics_undefined():
    trace_keys = {"seconds": 2, "truth": [[0, 0, 0], [1, math.nan, 0], [2, 0, 0]], "clearance": 0.5}
    found = compute_metrics(synthetic_trace(trace_keys), synthetic_case({}))
    assert found.undefined["path_length"] == found.undefined["heading_change"]
    assert found.undefined["path_length"].startswith("the true pose is not finite at t = ")
    assert (found.values["min_clearance"], found.values["collisions"]) == (0.5, 0.0)
