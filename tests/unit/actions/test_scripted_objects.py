"""Tests of actions on doors, scripted objects, and pushes, with exact numbers."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from simscen.actions.base import AnyAction
from simscen.actions.objects import pose_on_plan
from simscen.core.geometry import Pose2
from simscen.core.geometry.motion_paths import pose_at
from simscen.core.geometry.shapes import MotionPath
from simscen.core.messages.navigation import Path
from simscen.core.records.events import Event, EventKind
from simscen.testing.fakes import FakeStage

WIDE_OPEN = Pose2(0.0, 0.0, math.pi / 2)


class StageWithSwingingDoor(FakeStage):
    def door(self, name):
        return Pose2(0.0, 0.0, 0.0), WIDE_OPEN


def perform(stage, **action):
    return AnyAction.model_validate(action).perform(stage)


def motion_of(stage):
    ((_, _, path),) = stage.calls
    return path


def test_door_swings_for_its_whole_duration():
    stage = StageWithSwingingDoor(objects={"gate": Pose2(0.0, 0.0, 0.0)})
    assert perform(stage, open={"name": "gate", "duration": 2.0}).happened
    assert motion_of(stage).times[-1] == 2.0
    assert pose_at(motion_of(stage), 0.5).yaw == pytest.approx(math.pi / 8)
    assert motion_of(stage).poses[-1] == WIDE_OPEN


def test_reversed_door_returns_at_the_same_speed():
    stage = StageWithSwingingDoor(objects={"gate": Pose2(0.0, 0.0, math.pi / 6)})
    assert perform(stage, close={"name": "gate", "duration": 1.5}).what == "gate swings shut"
    assert motion_of(stage).times[-1] == pytest.approx(0.5)


def test_sliding_door_moves_in_a_straight_line():
    stage = FakeStage(objects={"gate": Pose2(0.25, 0.0, 0.0)})
    assert perform(stage, open={"name": "gate", "duration": 2.0}).what == "gate slides open"
    assert motion_of(stage) == MotionPath((0.0, 1.5), (Pose2(0.25, 0.0, 0.0), Pose2(1.0, 0.0, 0.0)))


def test_sliding_door_tolerates_a_rounded_heading():
    stage = FakeStage(objects={"gate": Pose2(0.25, 0.0, 1e-15)})
    assert perform(stage, open={"name": "gate"}).what == "gate slides open"


def test_door_ajar_is_open_by_the_given_fraction():
    stage = StageWithSwingingDoor(objects={"gate": Pose2(0.0, 0.0, 0.0)})
    assert perform(stage, open={"name": "gate", "to": "30 %", "duration": 1.0}).what == "gate swings 30% open"
    assert motion_of(stage).poses[-1].yaw == pytest.approx(0.3 * math.pi / 2)
    assert motion_of(stage).times[-1] == pytest.approx(0.3)


def test_opening_an_open_or_opening_door_has_no_effect():
    assert not perform(StageWithSwingingDoor(objects={"gate": WIDE_OPEN}), open={"name": "gate"}).happened
    opening = MotionPath((0.0, 1.0), (Pose2(0.0, 0.0, 0.0), WIDE_OPEN))
    stage = StageWithSwingingDoor(objects={"gate": Pose2(0.0, 0.0, 0.5)}, motions={"gate": (opening, 0.4)})
    effect = perform(stage, open={"name": "gate"})
    assert (effect.happened, effect.what) == (False, "gate already swings open")
    assert perform(stage, close={"name": "gate"}).happened


def test_paused_object_continues_from_its_position():
    path = MotionPath((0.0, 4.0), (Pose2(0, 0), Pose2(4, 0)), "back_and_forth", phase=1.0)
    stage = FakeStage(motions={"cart": (path, 1.5)})
    assert perform(stage, stop={"name": "cart", "for": "3 s"}).what == "stopped cart for 3 s"
    continued = motion_of(stage)
    assert [pose_at(continued, t).x for t in (0.0, 3.0, 4.0, 6.0)] == pytest.approx([2.5, 2.5, 3.5, 2.5])


def test_pause_delays_a_scheduled_start():
    path = MotionPath((0.0, 4.0), (Pose2(0, 0), Pose2(4, 0)), start=2.0)
    stage = FakeStage(motions={"cart": (path, 1.5)})
    assert perform(stage, stop={"name": "cart", "for": 3.0}).happened
    assert pose_at(motion_of(stage), 4.0) == Pose2(1.0, 0.0, 0.0)


@pytest.mark.parametrize("elapsed", [0.0, 7.0])
def test_an_object_that_stands_longer_than_the_pause_is_not_stopped(elapsed):
    path = MotionPath((0.0, 4.0), (Pose2(0, 0), Pose2(4, 0)), start=10.0)
    stage = FakeStage(motions={"cart": (path, elapsed)})
    effect = perform(stage, stop={"name": "cart", "for": 3.0})
    assert (effect.happened, effect.what, stage.calls) == (False, "cart was not moving", [])


def test_keyframes_at_the_pose_of_the_object_have_no_effect():
    stage = FakeStage(objects={"cart": Pose2(1.0, 2.0, 0.5)})
    assert not perform(stage, move={"name": "cart", "keyframes": [[0, 1, 2, 0.5], [3, 1, 2, 0.5]]}).happened
    assert perform(stage, move={"name": "cart", "keyframes": [[0, 1, 2, 0.5], [3, 1, 2, 0.6]]}).happened
    assert perform(stage, move={"name": "cart", "keyframes": [[2, 1, 2.1, 0.5]]}).happened


def test_moving_object_that_passes_its_waypoint_can_be_moved_to_it():
    circuit = MotionPath((0.0, 1.0, 2.0), (Pose2(1, 2), Pose2(2, 2), Pose2(1, 2)), "loop")
    stage = FakeStage(objects={"cart": Pose2(1.0, 2.0, 0.0)}, motions={"cart": (circuit, 2.0)})
    assert perform(stage, move={"name": "cart", "keyframes": [[1, 1, 2, 0]]}).happened
    assert pose_at(motion_of(stage), 1.5) == Pose2(1.0, 2.0, 0.0)


def test_stopped_object_stays_at_its_pose():
    path = MotionPath((0.0, 4.0), (Pose2(0, 0), Pose2(4, 0)))
    stage = FakeStage(motions={"cart": (path, 1.5)}, objects={"cart": Pose2(1.5, 0.0, 0.0)})
    assert perform(stage, stop={"name": "cart"}).happened
    assert stage.calls == [("place", "cart", Pose2(1.5, 0.0, 0.0))]
    assert not perform(FakeStage(), stop={"name": "cart"}).happened
    assert not perform(FakeStage(objects={"cart": None}), stop={"name": "cart"}).happened


def test_force_over_time_gives_its_impulse():
    stage = FakeStage()
    assert (
        perform(stage, push={"force": ["0.01 kN", 0], "for": "1.5 s"}).what == "pushed the robot with 10.0 N for 1.5 s"
    )
    assert perform(stage, push={"impulse": [0, 5], "name": "bin"}).what == "pushed bin with 5.0 N s"
    assert stage.calls == [("push", (15.0, 0.0), None, 1.5), ("push", (0.0, 5.0), "bin", 0.0)]


class StageWithFixedObjects(FakeStage):
    def mass(self, name):
        return 0.0


def test_push_without_a_movable_object_has_no_effect():
    assert not perform(FakeStage(objects={"bin": None}), push={"impulse": [0, 5], "name": "bin"}).happened
    assert not perform(StageWithFixedObjects(), push={"impulse": [0, 5], "name": "bin"}).happened
    assert not perform(FakeStage(), push={"impulse": [0, 0]}).happened


@pytest.mark.parametrize(
    ("text", "keys"),
    {
        "expected either impulse or force": {},
        "a force needs a duration `for`": {"force": [0, 1]},
        "an impulse has no duration `for`": {"impulse": [0, 1], "for": 1.0},
    }.items(),
)
def test_invalid_push_is_refused(text, keys):
    with pytest.raises(ValidationError, match=text):
        AnyAction.model_validate({"push": keys})


def test_teleport_moves_an_object_and_reports_the_distance():
    stage = FakeStage(objects={"bin": Pose2(1.0, 1.0, 0.0)})
    effect = perform(stage, teleport={"name": "bin", "pose": {"x": 4, "y": 5}})
    assert effect.what == "moved bin by 5.00 m to (4.00, 5.00)"
    assert stage.calls == [("place", "bin", Pose2(4.0, 5.0, 0.0))]
    assert not perform(stage, teleport={"name": "bin", "pose": {"x": 1, "y": 1}}).happened
    assert not perform(FakeStage(objects={"bin": None}), teleport={"name": "bin", "pose": {"x": 1, "y": 1}}).happened


def test_mark_is_recorded():
    stage = FakeStage()
    perform(stage, mark={"name": "in the aisle", "note": "sees the rack"})
    assert stage.calls == [("record_world_event", Event(0, EventKind.MARK, "in the aisle", {"note": "sees the rack"}))]


@pytest.mark.parametrize(("x", "expected"), [(0.0, 1.5), (4.0, 5.5), (6.0, 7.5), (9.0, 10.0), (-1.0, 1.5)])
def test_distance_on_a_plan_with_few_points_is_counted_from_the_robot(x, expected):
    plan = Path(np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]))
    assert pose_on_plan(plan, Pose2(x, 0.3), 1.5) == Pose2(expected, 0.0, 0.0)


def test_a_repeated_point_at_the_end_of_a_plan_does_not_change_the_heading():
    plan = Path(np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 2.0, 0.0]]))
    assert pose_on_plan(plan, Pose2(0.0, 0.0), 5.0) == Pose2(0.0, 2.0, math.pi / 2)
    assert pose_on_plan(Path(np.array([[1.0, 2.0, 3.0]] * 2)), Pose2(0.0, 0.0), 5.0) == Pose2(1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    "action",
    [
        {"spawn": {"name": "a", "box": [1.0, 1.0, 1.0], "pose": {"x": 0.0, "y": 0.0}, "yaw": 1.0}},
        {"friction": {"region": "hall", "name": "oil", "value": 0.1}},
    ],
)
def test_keys_that_would_be_ignored_are_errors(action):
    with pytest.raises(ValidationError, match=r"has no effect with|is only for a disc"):
        AnyAction.model_validate(action)


class StageWithoutFreeSpace(FakeStage):
    def region(self, name):
        return ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))

    def has_room(self, place, radius, walls_only=False):
        return not walls_only

    def rng(self, name):
        return np.random.default_rng(1)


def test_a_crowd_names_the_region_without_free_space():
    effect = perform(
        StageWithoutFreeSpace(), crowd={"name": "guest", "count": 3, "start": "hall", "goals": ["kitchen"]}
    )
    assert not effect.happened
    assert effect.what == "added only 0 of 3 people: no more free space in kitchen"
