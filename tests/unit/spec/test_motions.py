"""Tests of paths from `through` and `keyframes`."""

import itertools
import math

import pytest
from pydantic import ValidationError

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.motion_paths import pose_at, top_speed
from simscen.spec.motions import Motion

HERE = Pose2(0.0, 0.0, 1.0)


def path(here=HERE, **given):
    return Motion.model_validate(given).path(here)


def test_waypoints_are_passed_at_the_given_speed():
    motion = path(through=[[4, 0], [4, 2]], speed=2.0)
    assert motion.times[-1] == 3.0
    assert [pose_at(motion, t)[:2] for t in (1.0, 2.0, 2.5)] == [(2.0, 0.0), (4.0, 0.0), (4.0, 1.0)]


@pytest.mark.parametrize("repeat", ["once", "loop", "back_and_forth"])
def test_heading_follows_the_path_except_briefly_at_corners(repeat):
    motion = path(through=[[4, 0], [4, 4], [0, 4]], speed=1.0, repeat=repeat)
    corners = [0.0, 4.0, 8.0, 12.0, 16.0]
    for k in range(100 if repeat == "loop" else 120):
        t = k / 100 * motion.times[-1] + 1e-3
        near = min(abs(t - corner) for corner in corners)
        if t + 0.01 < motion.times[-1]:
            a, b = pose_at(motion, t), pose_at(motion, t + 0.005)
            off = abs(wrap(math.atan2(b.y - a.y, b.x - a.x) - a.yaw))
            assert off < 0.01 if near > 0.26 else off < math.pi / 4 + 0.1
    turns = [abs(wrap(pose_at(motion, (k + 1) / 240).yaw - pose_at(motion, k / 240).yaw)) for k in range(3 * 16 * 240)]
    assert max(turns) < 0.02, "it never turns at once, also where a loop begins anew"


def test_eased_motion_stops_and_turns_at_each_waypoint():
    motion = path(through=[[3, 0], [3, 3]], speed=1.5, ease="smooth")
    assert motion.times == pytest.approx((0.0, 3.0, 3.5, 6.5))
    assert top_speed(motion) == pytest.approx(1.5)
    assert pose_at(motion, 3.25)[:2] == (3.0, 0.0)
    assert pose_at(motion, 2.9).yaw == 0.0
    assert pose_at(motion, 3.6).yaw == pytest.approx(math.pi / 2)


def test_loop_of_waypoints_returns_to_its_start():
    motion = path(through=[[4, 0], [4, 3]], speed=1.0, repeat="loop")
    assert motion.times[-1] == 12.0
    assert pose_at(motion, 11.999999)[:2] == pytest.approx((0.0, 0.0), abs=1e-5)


def test_keyframes_with_units_have_the_given_poses_and_times():
    motion = path(keyframes=[["500 ms", "200 cm", 1, "90 deg"], [2.0, 3.0, 1.0, 0.0]])
    assert pose_at(motion, 0.0) == HERE, "it comes from where it is"
    assert pose_at(motion, 0.5) == pytest.approx(Pose2(2.0, 1.0, math.pi / 2))
    assert pose_at(motion, 9.0) == Pose2(3.0, 1.0, 0.0)


def test_first_keyframe_at_zero_sets_the_start_pose():
    assert pose_at(path(keyframes=[[0, 2, 1, 0], [1, 3, 1, 0]]), 0.0) == Pose2(2.0, 1.0, 0.0)


def test_full_turn_closes_a_loop():
    motion = path(
        keyframes=[[0, 1, 1, 0], [1, 2, 1, "120 deg"], [2, 2, 2, "240 deg"], [3, 1, 1, "360 deg"]], repeat="loop"
    )
    assert top_speed(motion, 0.5) < math.inf
    turned = [pose_at(motion, k / 50).yaw for k in range(301)]
    assert sum(wrap(b - a) for a, b in itertools.pairwise(turned)) == pytest.approx(4 * math.pi)


KEYFRAMES = [[0, 1, 1, 0], [2, 2, 1, 0]]
INVALID_MOTIONS = {
    "expected through and speed, or keyframes": {"speed": 1.0},
    "expected speed along waypoints": {"through": [[1, 1]]},
    "keyframes have times, and no speed": {"keyframes": KEYFRAMES, "speed": 1.0},
    "times of keyframes must rise": {"keyframes": [[0, 1, 1, 0], [2, 2, 1, 0], [2, 2, 2, 0]]},
    "needs keyframes": {"through": [[1, 1]], "speed": 1.0, "ease": "spline"},
    "`phase` needs keyframes": {"through": [[1, 1]], "speed": 1.0, "phase": 1.0},
    "the first of them at 0 s": {"keyframes": [[1, 1, 1, 0], [2, 2, 1, 0]], "repeat": "back_and_forth"},
    "two keyframes or more": {"keyframes": [[0, 1, 1, 0]], "repeat": "loop"},
    "the last keyframe of a loop must have the same pose": {"keyframes": KEYFRAMES, "repeat": "loop"},
    "phase 2 s is not within the 2 s": {"keyframes": KEYFRAMES, "phase": 2.0},
    "phase 4 s is not within the 4 s": {"keyframes": KEYFRAMES, "phase": 4.0, "repeat": "back_and_forth"},
}


@pytest.mark.parametrize(("expected_text", "given"), INVALID_MOTIONS.items(), ids=str)
def test_invalid_motions_are_rejected(expected_text, given):
    with pytest.raises(ValidationError, match=expected_text):
        Motion.model_validate(given)
