"""Why a robot is not where it believes to be."""

from whys import GOAL, by, slip, why


def test_a_robot_that_was_set_down_elsewhere_is_lost_for_that_reason():
    events = by("carried off", 6, [6, "robot.placed", "", {}])
    far = {"belief": {"offset": [2.0, 0, 0]}}
    case = {"goals": [GOAL]}
    assert why("goals_reached", events, case=case, **far) == [
        "why: it believed itself 2.00 m from where it was",
        "why: event `carried off` had set it down elsewhere 4.00 s before",
    ]
    assert why("localization_error", events, case=case, **far) == [
        "why: event `carried off` had set it down elsewhere 4.00 s before"
    ]
    assert why("localization_error", events, case=case) == [
        "meanwhile: event `carried off` came 4.00 s before: something"
    ]


def test_an_odometry_fault_leads_astray_long_after_it_is_over():
    lost = {"case": {"goals": [GOAL]}, "belief": {"offset": [0, 0.8, 0]}}
    assert why("localization_error", slip(1, 1.5, 2), **lost) == [
        "why: odom.slip falsified its odometry from t = 1.50 s on"
    ]
    assert why("localization_error", slip(1, 1.5, 2, "lidar.off", "off"), **lost) == []
