"""Tests of trigger conditions on both sides of their limits."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from pydantic import ValidationError

from simscen.core.clock import Clock
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief
from simscen.core.records.events import Event, EventKind
from simscen.triggers.base import Condition, Trigger
from simscen.triggers.events import EventStatus, PedestrianStatus
from simscen.triggers.timing import Time

STILL, CLOCK = Twist(0.0), Clock(240)
HALL = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))


@dataclass
class Situation:
    """Situation whose values are set by the test; `scans` are the ticks of the last scans by sensor."""

    tick: int = 0
    robot: Pose2 = Pose2(0.0, 0.0)
    twist: Twist = STILL
    travelled: float = 0.0
    belief: Belief | None = None
    goal: Goal | None = None
    events: tuple[Event, ...] = ()
    objects: dict = field(default_factory=dict)
    clock: Clock = CLOCK
    clearance: float | None = None
    scans: dict = field(default_factory=dict)

    def last_scan_tick(self, sensor):
        return max(self.scans.values(), default=None) if sensor is None else self.scans.get(sensor)

    def region(self, name):
        return {"hall": HALL}[name]

    def object(self, name):
        return self.objects.get(name)


def holds(words, **situation) -> bool:
    """Return whether the trigger, written as in a scenario, holds in the situation."""
    return Trigger.model_validate(words).holds(Situation(**situation))


@pytest.mark.parametrize(("tick", "expected"), [(239, False), (240, True), (241, True)])
def test_time_holds_from_its_tick_on(tick, expected):
    assert holds({"time": "1 s"}, tick=tick) is expected


@pytest.mark.parametrize(("meters", "expected"), [(1.99, False), (2.0, True), (2.01, True)])
def test_distance_traveled_holds_from_the_given_distance(meters, expected):
    assert holds({"travelled": 2.0}, travelled=meters) is expected


@pytest.mark.parametrize(
    ("twist", "below", "above"),
    [
        (Twist(0.29, 0.4), True, False),
        (Twist(0.3, 0.4), False, False),
        (Twist(0.31, 0.4), False, True),
        (Twist(-0.31, -0.4), False, True),
        (Twist(0.0, 0.0, 3.0), True, False),
    ],
)
def test_speed_is_over_ground_and_compared_strictly(twist, below, above):
    assert holds({"speed_below": 0.5}, twist=twist) is below
    assert holds({"speed_above": 0.5}, twist=twist) is above


@pytest.mark.parametrize(("x", "expected"), [(0.99, False), (1.0, True), (1.01, True), (5.01, False)])
def test_distance_remaining_is_euclidean(x, expected):
    goal = Goal("desk", Pose2(3.0, 2.0))
    assert holds({"distance_remaining": 2}, robot=Pose2(x, 2.0), goal=goal) is expected


def test_distance_remaining_does_not_hold_without_a_goal():
    assert not holds({"distance_remaining": 100})


@pytest.mark.parametrize(("offset", "expected"), [(0.49, False), (0.5, False), (0.51, True)])
def test_localization_error_holds_above_the_bound(offset, expected):
    belief = Belief(Pose2(1.0, 1.0 + offset), np.eye(3))
    assert holds({"localization_error": 0.5}, robot=Pose2(1.0, 1.0), belief=belief) is expected


def test_localization_error_does_not_hold_without_a_belief():
    assert not holds({"localization_error": 0})


@pytest.mark.parametrize(("x", "expected"), [(0.99, False), (1.0, True), (5.01, False)])
def test_believed_distance_remaining_uses_the_estimate(x, expected):
    goal, belief = Goal("desk", Pose2(3.0, 2.0)), Belief(Pose2(x, 2.0), np.eye(3))
    words = {"believed_distance_remaining": 2}
    assert holds(words, robot=Pose2(-50.0, 2.0), goal=goal, belief=belief) is expected
    assert not holds(words, robot=Pose2(3.0, 2.0), goal=goal)
    assert not holds(words, belief=belief)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("rate", "below", "above"), [(0.49, True, False), (0.5, False, False), (0.51, False, True)])
def test_turn_rate_is_compared_without_its_sign(rate, below, above, sign):
    twist = Twist(3.0, 0.0, sign * rate)
    assert holds({"turning_below": "0.5 rad/s"}, twist=twist) is below
    assert holds({"turning_above": "0.5 rad/s"}, twist=twist) is above


@pytest.mark.parametrize(
    ("clearance", "expected"), [(None, False), (0.31, False), (0.3, False), (0.29, True), (-1, True)]
)
def test_clearance_below_compares_strictly(clearance, expected):
    assert holds({"clearance_below": "30 cm"}, clearance=clearance) is expected


@pytest.mark.parametrize(("tick", "expected"), [(219, False), (220, False), (221, True)])
def test_scan_age_counts_from_reception_by_the_stack(tick, expected):
    scans = {"lidar": 100, "rear": 90}
    assert holds({"scan_age": {"above": "0.5 s"}}, tick=tick, scans=scans) is expected
    assert holds({"scan_age": {"above": "0.5 s", "sensor": "lidar"}}, tick=tick, scans=scans) is expected
    assert holds({"scan_age": {"above": "0.5 s", "sensor": "rear"}}, tick=tick - 10, scans=scans) is expected


@pytest.mark.parametrize(("tick", "expected"), [(120, False), (121, True)])
def test_scan_age_counts_from_the_start_before_the_first_scan(tick, expected):
    assert holds({"scan_age": {"above": "0.5 s"}}, tick=tick) is expected
    assert holds({"scan_age": {"above": "0.5 s", "sensor": "rear"}}, tick=tick, scans={"lidar": tick}) is expected


@pytest.mark.parametrize(
    ("offset", "turn", "expected"), [(0.5, 0.5, False), (0.51, 0.0, True), (0.0, 0.53, True), (0.0, 2 * np.pi, False)]
)
def test_robot_is_lost_if_position_or_heading_is_wrong(offset, turn, expected):
    belief = Belief(Pose2(1.0, 1.0 + offset, 3.0 + turn), np.eye(3) * 100)
    assert holds({"localization_lost": {}}, robot=Pose2(1.0, 1.0, 3.0), belief=belief) is expected


@pytest.mark.parametrize(("bound", "expected"), [(0.499, True), (0.501, False)])
def test_uncertain_robot_is_lost_by_its_largest_standard_deviation(bound, expected):
    rotation = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    covariance = np.eye(3)
    covariance[:2, :2] = rotation @ np.diag([0.5**2, 0.1**2]) @ rotation.T
    belief = Belief(Pose2(1.0, 1.0), covariance)
    assert holds({"localization_lost": {"std": bound}}, robot=Pose2(1.0, 1.0), belief=belief) is expected


def test_a_belief_at_its_limits_is_not_lost():
    limits = {"tolerance": 0.5, "yaw_tolerance": 0.5, "std": 0.5}
    belief = Belief(Pose2(0.0, 0.0), np.diag([0.25, 0.25, 0.0]))
    assert not holds({"localization_lost": limits}, robot=Pose2(0.5, 0.0, 0.5), belief=belief)
    certain = Belief(Pose2(0.0, 0.0), np.diag([0.01, 0.0025, 0.0]))
    assert not holds({"localization_lost": {"std": 0.1001}}, robot=Pose2(0.0, 0.0), belief=certain)
    assert holds({"localization_lost": {"std": 0.0999}}, robot=Pose2(0.0, 0.0), belief=certain)


def test_robot_is_not_lost_without_a_belief():
    assert not holds({"localization_lost": {"std": 0.001}})


@pytest.mark.parametrize(("x", "expected"), [(1.0, True), (2.0, True), (2.001, False)])
def test_region_includes_its_edge(x, expected):
    assert holds({"robot_in": {"region": "hall"}}, robot=Pose2(x, 1.0)) is expected


@pytest.mark.parametrize(("x", "expected"), [(3.49, True), (3.5, True), (3.51, False)])
def test_robot_within_includes_the_given_distance(x, expected):
    assert holds({"robot_within": {"region": "hall", "distance": 1.5}}, robot=Pose2(x, 1.0)) is expected
    assert holds({"robot_within": {"of": [2, 1], "distance": 1.5}}, robot=Pose2(x, 1.0)) is expected
    objects = {"cart": Pose2(2.0, 1.0)}
    assert (
        holds({"robot_within": {"object": "cart", "distance": 1.5}}, robot=Pose2(x, 1.0), objects=objects) is expected
    )


def test_x_and_y_of_a_point_are_not_swapped():
    assert holds({"robot_within": {"of": [5, 7], "distance": 0}}, robot=Pose2(5.0, 7.0))
    assert not holds({"robot_within": {"of": [5, 7], "distance": 1}}, robot=Pose2(7.0, 5.0))


def test_robot_is_not_within_any_distance_of_a_missing_object():
    assert not holds({"robot_within": {"object": "cart", "distance": 1000}})


@pytest.mark.parametrize("words", [{}, {"of": [1, 1], "object": "cart"}, {"object": "cart", "region": "hall"}])
def test_robot_within_needs_exactly_one_target(words):
    with pytest.raises(ValidationError, match="exactly one of: of, object, region"):
        Trigger.model_validate({"robot_within": {**words, "distance": 1}})


LOGGED = {
    "goal": ({"name": "a", "status": "reached"}, EventKind.GOAL_REACHED),
    "event": ({"name": "a"}, EventKind.EVENT_STARTED),
    "recovery": ({"name": "spin"}, EventKind.RECOVERY_STARTED),
    "collision": ({"with": "a"}, EventKind.COLLISION_STARTED),
    "pedestrian": ({"name": "anna", "status": "calmed"}, EventKind.PEDESTRIAN_CALMED),
}


@pytest.mark.parametrize("kind", LOGGED)
def test_logged_events_count_by_kind_and_name(kind):
    words, logged = LOGGED[kind]
    name = next(value for key, value in words.items() if key in ("name", "with"))
    assert not holds({kind: words})
    assert not holds({kind: words}, events=(Event(1, EventKind.RUN_ENDED, name),))
    assert not holds({kind: words}, events=(Event(1, logged, "other"),))
    assert holds({kind: words}, events=(Event(1, logged, "other"), Event(2, logged, name)))


@pytest.mark.parametrize("kind", ["goal", "recovery", "collision", "pedestrian"])
def test_condition_without_a_name_counts_all_events(kind):
    words, logged = LOGGED[kind]
    unnamed = {key: value for key, value in words.items() if key == "status"}
    assert holds({kind: unnamed}, events=(Event(1, logged, "whatever"),))
    assert not holds({kind: unnamed})


@pytest.mark.parametrize("kind", ["goal", "recovery", "pedestrian"])
def test_event_must_happen_the_given_number_of_times(kind):
    words, logged = LOGGED[kind]
    name = words["name"]
    once, twice = (tuple(Event(k, logged, name) for k in range(n)) for n in (1, 2))
    assert not holds({kind: {**words, "count": 2}}, events=once)
    assert holds({kind: {**words, "count": 2}}, events=twice)
    assert holds({kind: words}, events=once)


def test_end_of_an_event_does_not_count_as_its_start():
    ended = (Event(1, EventKind.EVENT_ENDED, "a"),)
    assert not holds({"event": {"name": "a"}}, events=ended)
    assert holds({"event": {"name": "a", "status": "ended"}}, events=ended)


def test_start_and_end_of_a_fault_count_like_those_of_an_event():
    started, ended = Event(1, EventKind.FAULT_STARTED, "lidar.off"), Event(2, EventKind.FAULT_ENDED, "lidar.off")
    assert holds({"event": {"name": "lidar.off"}}, events=(started,))
    assert not holds({"event": {"name": "lidar.off", "status": "ended"}}, events=(started,))
    assert holds({"event": {"name": "lidar.off", "status": "ended"}}, events=(started, ended))
    assert not holds({"event": {"name": "odom.bias"}}, events=(started, ended))


def test_a_replan_is_a_plan_that_is_not_for_a_new_goal():
    first, replan = (
        Event(1, EventKind.PLAN_MADE, "", {"reason": "goal"}),
        Event(2, EventKind.PLAN_MADE, "", {"reason": "blocked"}),
    )
    failure = Event(3, EventKind.PLAN_FAILED, "", {"reason": "blocked"})
    assert not holds({"replan": {}}, events=(first, first, failure))
    assert holds({"replan": {}}, events=(first, replan))
    assert not holds({"replan": {"count": 2}}, events=(first, replan))
    assert holds({"replan": {"count": 2}}, events=(replan, replan))


SOON, LATE = {"time": 1}, {"time": 2}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ({"all": [SOON, SOON]}, True),
        ({"all": [SOON, LATE]}, False),
        ({"any": [SOON, LATE]}, True),
        ({"any": [LATE, LATE]}, False),
        ({"not": SOON}, False),
        ({"not": LATE}, True),
        ({"all": [SOON, {"not": {"any": [LATE]}}]}, True),
    ],
)
def test_conditions_combine(words, expected):
    assert holds(words, tick=240) is expected


def test_default_trigger_fires_once_immediately_and_certainly():
    trigger = Trigger.model_validate({"time": 1})
    assert (trigger.edge, trigger.delay, trigger.times, trigger.probability) == ("rising", 0.0, 1, 1.0)


@pytest.mark.parametrize("words", [{"times": 0}, {"times": 10_001}, {"delay": -1}, {"probability": 1.5}])
def test_impossible_trigger_is_refused(words):
    with pytest.raises(ValidationError):
        Trigger.model_validate({"time": 1, **words})


TOUR = tuple(
    Event(tick, kind, name)
    for tick, kind, name in (
        (1, EventKind.GOAL_ACCEPTED, "shelf"),
        (2, EventKind.GOAL_REACHED, "shelf"),
        (3, EventKind.GOAL_FAILED, "door"),
        (4, EventKind.GOAL_PASSED, "shelf#2"),
    )
)


@pytest.mark.parametrize(
    ("words", "first_count"),
    [
        ({}, 2),
        ({"count": 2}, 4),
        ({"name": "shelf", "count": 2}, 4),
        ({"name": "shelf#2"}, 4),
        ({"name": "door"}, None),
    ],
)
def test_waypoints_are_goals_that_were_reached_or_passed_in_any_loop(words, first_count):
    counts = [count for count in range(len(TOUR) + 1) if holds({"waypoint": words}, events=TOUR[:count])]
    assert counts == ([] if first_count is None else list(range(first_count, len(TOUR) + 1)))


@pytest.mark.parametrize("kind", ["goal", "replan", "recovery"])
@pytest.mark.parametrize("count", [0, 10_001])
def test_counts_are_between_1_and_10000(kind, count):
    words = {"goal": {"status": "reached"}, "replan": {}, "recovery": {}}[kind]
    with pytest.raises(ValidationError, match="count"):
        Trigger.model_validate({kind: {**words, "count": count}})
    for valid_count in (1, 10_000):
        assert Trigger.model_validate({kind: {**words, "count": valid_count}}).kind == kind


@pytest.mark.parametrize("key", ["all", "any"])
def test_combinations_have_one_to_fifty_parts(key):
    assert Trigger.model_validate({key: [SOON] * 50}).kind == key
    for parts in ([], [SOON] * 51):
        with pytest.raises(ValidationError):
            Trigger.model_validate({key: parts})


@pytest.mark.parametrize("condition", [Time, EventStatus, PedestrianStatus])
def test_conditions_about_the_world_need_no_robot(condition: type[Condition]) -> None:
    assert not condition.is_robot_specific
    assert Condition.is_robot_specific
