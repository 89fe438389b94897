"""Tests of the diagnosis of localization errors."""

from diagnosis_cases import GOAL, slip, why, with_event


def test_kidnapping_explains_a_localization_error():
    events = with_event("carried off", 6, [6, "robot.placed", "", {}])
    far = {"belief": {"offset": [2.0, 0, 0]}}
    case = {"goals": [GOAL]}
    assert why("goals_reached", events, case=case, **far) == [
        "why: the estimated position was 2.00 m from the true position",
        "why: event `carried off` had moved the robot elsewhere 4.00 s before",
    ]
    assert why("localization_error", events, case=case, **far) == [
        "why: event `carried off` had moved the robot elsewhere 4.00 s before"
    ]
    assert why("localization_consistency", events, case=case, **far) == why("goals_reached", events, case=case, **far)
    assert why("localization_error", events, case=case) == [
        "meanwhile: event `carried off` happened 4.00 s before: something"
    ]


def test_odometry_fault_explains_a_localization_error_after_it_has_ended():
    lost = {"case": {"goals": [GOAL]}, "belief": {"offset": [0, 0.8, 0]}}
    assert why("localization_error", slip(1, 1.5, 2), **lost) == [
        "why: odom.slip falsified the odometry from t = 1.50 s on"
    ]
    assert why("localization_error", slip(1, 1.5, 2, "lidar.off", "off"), **lost) == []


def test_belief_faults_explain_a_localization_error_and_lidar_faults_do_not():
    lost = {"case": {"goals": [GOAL]}, "belief": {"offset": [0, 0.8, 0]}}
    jump = slip(1, 1.5, 2, "localizer.jump", "jump", affects="Belief")
    assert why("localization_error", jump, **lost) == ["why: localizer.jump falsified the belief from t = 1.50 s on"]
    assert why("localization_error", slip(1, 1.5, 2, "lidar.bias", "bias", affects="Scan"), **lost) == []
    scaled = slip(1, 1.5, 2, "odom.scale", "scale", affects="Odometry")
    assert why("localization_error", scaled, **lost) == ["why: odom.scale falsified the odometry from t = 1.50 s on"]


def test_error_of_half_a_meter_counts_as_lost():
    case = {"goals": [GOAL]}
    at_one = {"seconds": 10, "truth": [[0, 0, 1]]}
    half = why("goals_reached", [], trace=at_one, case=case, belief={"offset": [0.5, 0, 0]})
    assert half == ["why: the estimated position was 0.50 m from the true position"]
    assert why("goals_reached", [], trace=at_one, case=case, belief={"offset": [0, 0.8, 0]}) == [
        "why: the estimated position was 0.80 m from the true position"
    ]
    assert why("goals_reached", [], trace=at_one, case=case, belief={"offset": [0.49, 0, 0]}) == []


def test_events_up_to_the_failure_tick_count():
    lost = {"case": {"goals": [GOAL]}, "belief": {"offset": [2, 0, 0]}}
    events = with_event("carried off", 6, [6, "robot.placed", "", {}])
    assert why("localization_error", events, at=6, **lost) == [
        "why: event `carried off` had moved the robot elsewhere 0.00 s before"
    ]
    assert why("localization_error", events, at=5.9, **lost) == []


def test_robot_without_estimate_is_not_reported_as_lost():
    assert why("goals_reached", [], case={"goals": [GOAL]}, belief=None) == []
