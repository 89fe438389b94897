"""Tests of scripted motion along paths: poses, speeds, and swept segments."""

import itertools
import math
import random

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.motion_paths import PathSampler, largest_step, pose_at, swept_segments, top_speed
from simscen.core.geometry.shapes import MotionPath

POSES = (Pose2(0, 0, 0), Pose2(2, 0, 0), Pose2(2, 1, math.pi / 2))


def test_path_without_repetition_stays_at_its_end():
    path = MotionPath((0.0, 2.0, 3.0), POSES, "once", start=1.0)
    assert pose_at(path, 0.5) == Pose2(0, 0, 0)
    assert pose_at(path, 2.0) == Pose2(1, 0, 0)
    assert pose_at(path, 3.5) == pytest.approx(Pose2(2, 0.5, math.pi / 4))
    assert pose_at(path, 99.0) == POSES[-1]


def test_loop_restarts_at_its_first_pose():
    path = MotionPath((0.0, 2.0, 3.0), POSES, "loop")
    assert pose_at(path, 3.0 + 1.0) == pytest.approx(Pose2(1, 0, 0))


def test_back_and_forth_returns_along_the_same_path():
    path = MotionPath((0.0, 2.0, 3.0), POSES, "back_and_forth")
    assert pose_at(path, 3.0 + 1.0 + 0.5) == pytest.approx(pose_at(path, 1.5))
    assert pose_at(path, 6.0 + 1.0) == pytest.approx(pose_at(path, 1.0))


def test_headings_are_interpolated_in_the_shorter_direction():
    path = MotionPath((0.0, 1.0), (Pose2(0, 0, 3.0), Pose2(0, 0, -3.0)))
    assert abs(pose_at(path, 0.5).yaw) == pytest.approx(math.pi)


def test_path_with_one_waypoint_stays_there():
    assert pose_at(MotionPath((0.0,), (Pose2(1, 2, 3),), "loop"), 5.0) == Pose2(1, 2, 3)


def test_top_speed_is_the_speed_of_the_fastest_leg():
    path = MotionPath((0.0, 2.0, 3.0), POSES)
    assert top_speed(path) == pytest.approx(1.0)
    assert top_speed(path, reach=0.5) == pytest.approx(1.0 + 0.5 * math.pi / 2)


def test_top_speed_of_a_loop_that_is_not_closed_is_infinite():
    assert top_speed(MotionPath((0.0, 2.0), POSES[:2], "loop")) == math.inf
    closed_path = MotionPath((0.0, 1.0, 2.0), (Pose2(0, 0, 0), Pose2(1, 0, 0), Pose2(0, 0, 0)), "loop")
    assert top_speed(closed_path) == pytest.approx(1.0)


CLOSED_POSES = (Pose2(0, 0, 0), Pose2(2, 0, 1.5), Pose2(2, 1, 3.0), Pose2(0, 1, -2.0), Pose2(0, 0, 0))
UNEVEN_TIMES = (0.0, 1.0, 3.0, 3.5, 5.0)


def scipy_spline(path, is_closed):
    """Return the spline of a path, computed with SciPy."""
    values = np.array(path.poses)
    values[:, 2] = np.unwrap(values[:, 2])
    slopes = np.zeros_like(values)
    times = np.array(path.times)
    slopes[1:-1] = (values[2:] - values[:-2]) / (times[2:] - times[:-2])[:, None]
    if is_closed:
        difference = values[1] - values[0] + values[-1] - values[-2]
        slopes[0] = slopes[-1] = difference / (times[1] - times[0] + times[-1] - times[-2])
    return CubicHermiteSpline(times, values, slopes)


@pytest.mark.parametrize("mode", ["once", "loop"])
def test_spline_is_the_documented_cubic_hermite_curve(mode):
    path = MotionPath(UNEVEN_TIMES, CLOSED_POSES, mode, ease="spline")
    expected = scipy_spline(path, mode == "loop")
    for seconds in np.linspace(0.0, 4.999, 97):
        x, y, yaw = expected(seconds)
        assert pose_at(path, seconds) == pytest.approx(Pose2(x, y, wrap(yaw)), abs=1e-12)


def test_smooth_segment_starts_and_ends_at_rest_and_peaks_at_1_5_times_the_mean_speed():
    path = MotionPath((0.0, 2.0), (Pose2(0, 0), Pose2(3, 0)), ease="smooth")
    assert pose_at(path, 0.5).x == pytest.approx(3 * (3 * 0.25**2 - 2 * 0.25**3))
    speeds = np.diff([pose_at(path, t).x for t in np.linspace(0, 2, 2001)]) / 0.001
    assert speeds[0] < 0.01 and speeds[-1] < 0.01
    assert speeds.max() == pytest.approx(1.5 * 1.5, rel=1e-5)
    assert top_speed(path) == pytest.approx(1.5 * 1.5)


@pytest.mark.parametrize("ease", ["linear", "smooth", "spline"])
@pytest.mark.parametrize("mode", ["once", "loop", "back_and_forth"])
def test_speed_never_exceeds_the_top_speed(ease, mode):
    path = MotionPath(UNEVEN_TIMES, CLOSED_POSES, mode, ease=ease)
    step = 1 / 500
    poses = [pose_at(path, step * k) for k in range(5500)]
    speeds = [(a.distance(b) + 0.3 * abs(wrap(b.yaw - a.yaw))) / step for a, b in itertools.pairwise(poses)]
    assert 0.5 * top_speed(path, 0.3) < max(speeds) <= top_speed(path, 0.3) + 1e-9


@pytest.mark.parametrize("mode", ["once", "loop", "back_and_forth"])
def test_velocity_of_a_spline_is_continuous(mode):
    path = MotionPath(UNEVEN_TIMES, CLOSED_POSES, mode, ease="spline")
    step = 5e-4
    poses = [pose_at(path, step * k) for k in range(22_000)]
    velocity = np.diff([pose[:2] for pose in poses], axis=0) / step
    assert np.abs(np.diff(velocity, axis=0)).max() < 0.02


def test_phase_sets_the_first_pose_and_start_the_time_of_departure():
    path = MotionPath((0.0, 2.0, 3.0), POSES, "back_and_forth")
    delayed = MotionPath((0.0, 2.0, 3.0), POSES, "back_and_forth", start=1.5, phase=4.0)
    assert pose_at(delayed, 0.0) == pose_at(delayed, 1.5) == pose_at(path, 4.0)
    assert pose_at(delayed, 2.5) == pose_at(path, 5.0)
    assert not delayed.has_ended(1e9)
    assert MotionPath((0.0, 2.0, 3.0), POSES, start=1.0, phase=1.0).has_ended(3.0)
    assert not MotionPath((0.0, 2.0, 3.0), POSES, start=1.0, phase=1.0).has_ended(2.9)


@pytest.mark.parametrize("mode", ["once", "loop", "back_and_forth"])
@pytest.mark.parametrize("ease", ["linear", "smooth", "spline"])
def test_path_sampler_equals_pose_at_bit_for_bit(mode, ease):
    """The times are not sorted. The path has legs of zero duration, and legs with and without a rotation."""
    poses = (Pose2(0, 0, 3.0), Pose2(1, 0, 3.0), Pose2(1, 2, -3.0), Pose2(4, 2, -3.0), Pose2(0.3, 0, 3.0))
    path = MotionPath((1.0, 2.0, 3.5, 3.5, 5.0), poses, mode, 0.7, ease, 0.2)
    sampler, times = PathSampler(path, 0.4), [k * 0.1 for k in range(150)]
    for seconds in [*times, *times[::-7]]:
        assert sampler.at(seconds) == Pose3.planar(pose_at(path, seconds), 0.4)
    assert PathSampler(MotionPath((0.0,), (Pose2(1, 2, 3),)), 0.0).at(5.0) == Pose3.planar(Pose2(1, 2, 3))


@pytest.mark.parametrize("mode", ["once", "loop", "back_and_forth"])
@pytest.mark.parametrize("ease", ["linear", "smooth", "spline"])
def test_motion_stays_within_the_stated_distance_of_its_path(ease, mode):
    rng = random.Random(5)
    min_distances = []
    for _ in range(20):
        poses = tuple(Pose2(rng.uniform(-5, 5), rng.uniform(-5, 5), rng.uniform(-3, 3)) for _ in range(4))
        path = MotionPath((0.0, *sorted(rng.uniform(0.1, 9) for _ in range(3))), poses, mode, ease=ease)
        for number in range(60):
            x, y, _ = pose_at(path, 0.3 * number)
            distances = [(distance_to_segment(x, y, segment), segment.deviation) for segment in swept_segments(path)]
            assert any(meters <= deviation + 1e-9 for meters, deviation in distances)
            min_distances.append(min(meters for meters, _ in distances))
    assert (max(min_distances) > 0.1) == (ease == "spline")


def distance_to_segment(x, y, segment):
    """Return the distance in m of a point from a segment."""
    start, along = complex(segment.x, segment.y), complex(segment.to_x - segment.x, segment.to_y - segment.y)
    share = (complex(x, y) - start) / along
    return abs(complex(x, y) - start - min(max(share.real, 0.0), 1.0) * along)


def max_swept_length(path, begin, end, reach):
    """Return the length in m of the longest path of 12 points of a body of radius `reach`, from small time steps."""
    poses = np.array([pose_at(path, begin + (end - begin) * k / 50) for k in range(51)])
    directions = poses[:, 2:] + np.linspace(0, 2 * math.pi, 12)
    rim_points = poses[:, :2, None] + reach * np.stack((np.cos(directions), np.sin(directions)), axis=1)
    point_tracks = np.concatenate((rim_points, poses[:, :2, None]), axis=2)
    return float(np.hypot(*np.diff(point_tracks, axis=0).transpose(1, 0, 2)).sum(axis=0).max())


@pytest.mark.sample(4)
@pytest.mark.parametrize("mode", ["once", "loop", "back_and_forth"])
@pytest.mark.parametrize("ease", ["linear", "smooth", "spline"])
def test_no_point_moves_farther_than_the_largest_step(mode, ease):
    rng = random.Random(f"{mode} {ease}")
    for _ in range(40):
        count, reach = rng.randint(2, 6), rng.uniform(0, 1)
        times = tuple(itertools.accumulate((rng.choice([0.01, 0.3, 1.0]) for _ in range(count - 1)), initial=0.0))
        poses = [Pose2(*(rng.uniform(-2, 2) for _ in range(3))) for _ in range(count)]
        poses[-1] = poses[0] if mode == "loop" else poses[-1]
        path, step = MotionPath(times, tuple(poses), mode, 0.0, ease), rng.choice([0.005, 0.1, 2.0])
        step_limit = largest_step(path, step, reach)
        for _ in range(20):
            begin = rng.uniform(-step, 2 * times[-1])
            assert max_swept_length(path, begin, begin + step, reach) <= step_limit + 1e-9


def test_largest_step_of_uniform_motion_is_speed_times_time():
    assert largest_step(MotionPath((0.0, 2.0, 3.0), POSES), 0.1) == pytest.approx(0.1)
    turn = MotionPath((0.0, 0.004), (Pose2(0, 0, 0), Pose2(0, 0, math.pi / 2)))
    assert largest_step(turn, 1 / 240, 0.5) == pytest.approx(math.pi / 4)
    assert largest_step(MotionPath((0.0,), POSES[:1]), 1.0) == 0.0


def test_jumps_do_not_count_as_steps():
    poses = (Pose2(0, 0, 0), Pose2(1, 0, 0), Pose2(5, 0, 1), Pose2(6, 0, 1))
    assert largest_step(MotionPath((0.0, 1.0, 1.0, 2.0), poses, "loop"), 0.1, 0.5) == pytest.approx(0.1)
