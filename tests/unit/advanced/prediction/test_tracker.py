"""Tests of the tracker of moving obstacles on simulated scans with known motion."""

import cmath
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from simscen.advanced.prediction.clusters import (
    CONVERGED_STEP_M,
    find_clusters,
    find_segments,
    fit_circle,
)
from simscen.advanced.prediction.current_scan import CurrentScan
from simscen.advanced.prediction.tracker import Tracker
from simscen.advanced.prediction.tracks import Track
from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Prediction
from simscen.testing.flatland import TICK_RATE_HZ, Flatland

Disc = tuple[float, float, float]
"""x, y, and radius in m."""
FULL, FRONT = 2 * math.pi, math.radians(270.0)
"""Fields of view in rad."""


class Scene:
    """Tracker of a lidar at 10 Hz.

    At time t, the robot is at `base(t)`, odometry reports the pose `odometry(t)`, and `discs(t)` are the moving discs.
    """

    def __init__(
        self,
        discs: Callable[[float], list[Disc]],
        base: Callable[[float], Pose2] = lambda _: Pose2(0.0, 0.0),
        odometry: Callable[[float], Pose2] | None = None,
        walls: Flatland | None = None,
        view: float = FRONT,
        beams: int = 720,
        covered: float | None = None,
        max_range: float = 30.0,
    ) -> None:
        """Create the tracker; `covered` replaces the ranges of the first 40 beams, as if the lens were covered."""
        self.discs, self.base, self.odometry = discs, base, odometry or base
        self.walls, self.view, self.beams, self.covered = walls or Flatland(), view, beams, covered
        self.max_range = max_range
        self.tracker, self.rng, self.time = Tracker(Prediction(), TICK_RATE_HZ), np.random.default_rng(1), 0.0

    def run(self, seconds: float, on_scan: Callable[["Scene"], None] = lambda _: None) -> "Scene":
        """Run the tracker for `seconds`, and call `on_scan` after each scan."""
        for _ in range(round(seconds * 10)):
            self.time = round(self.time + 0.1, 6)
            pose = self.base(self.time)
            world = Flatland(self.walls.boxes, [*self.walls.discs, *self.discs(self.time)])
            step = self.view / (self.beams if self.view == FULL else self.beams - 1)
            angles = -self.view / 2 + step * np.arange(self.beams)
            ranges = world.cast((pose.x, pose.y), angles + pose.yaw) + self.rng.normal(0, 0.01, self.beams)
            ranges = np.round(np.where(ranges > self.max_range, np.inf, ranges), 3)
            if self.covered is not None:
                ranges[:40] = self.covered
            scan = Scan("lidar", round(self.time * TICK_RATE_HZ), ranges, -self.view / 2, step, 0.1, self.max_range)
            self.scan = scan
            self.tracker.on_scan(scan, self.odometry(self.time))
            on_scan(self)
        return self


def crossing(t: float) -> list[Disc]:
    return [(4.0, -3.0 + 1.2 * t, 0.5)]


def oncoming(t: float) -> list[Disc]:
    return [(9.0 - 1.5 * t, 0.3, 0.3)]


def static_room() -> Flatland:
    """Return a room with pillars of all sizes, a doorway, and a box."""
    world = Flatland().room(12, 8)
    world.boxes += [(5.0, 0.0, 5.1, 3.0), (5.0, 4.0, 5.1, 8.0), (8.0, 2.0, 8.6, 2.6)]
    world.discs += [(2.0 + 0.9 * k, 6.0, 0.05 + 0.03 * k) for k in range(8)]
    return world


@pytest.mark.parametrize("discs", [crossing, oncoming])
@pytest.mark.parametrize("view, beams", [(FRONT, 720), (FULL, 360), (-FRONT, 720)])
def test_moving_cylinder_is_detected_within_1_2_s_and_tracked_within_centimeters(
    discs: Callable[[float], list[Disc]], view: float, beams: int
) -> None:
    scene = Scene(discs, view=view, beams=beams).run(1.2)
    assert len(scene.tracker.moving) == 1
    position_errors, velocity_errors = [], []

    def compare(scene: Scene) -> None:
        x, y, radius = discs(scene.time)[0]
        later = discs(scene.time + 1.0)[0]
        moving = scene.tracker.moving
        assert len(moving) == 1
        position_errors.append(math.dist(moving.centers[0], (x, y)))
        velocity_errors.append(math.dist(moving.velocities[0], (later[0] - x, later[1] - y)))
        assert moving.radii[0] == pytest.approx(radius, abs=0.08)
        hits = replace(scene.scan, ranges=np.where(scene.tracker.moving_hits, scene.scan.ranges, np.inf)).points()
        assert len(hits) > 0
        assert np.hypot(*(hits - (x, y)).T).max() < radius + 0.3

    scene.run(2.0, compare)
    assert np.median(position_errors) < 0.04 and max(position_errors) < 0.12
    assert np.median(velocity_errors) < 0.12 and max(velocity_errors) < 0.45


def test_the_covariance_covers_the_error() -> None:
    """The position NEES of a consistent filter is 2 on average. It is lower here, as the filter allows for turns."""
    scene, values = Scene(crossing).run(1.5), list[float]()

    def compare(scene: Scene) -> None:
        moving = scene.tracker.moving
        error = moving.centers[0] - np.array(crossing(scene.time)[0][:2])
        values.append(float(error @ np.linalg.solve(moving.covariances[0, :2, :2], error)))
        assert math.sqrt(moving.covariances[0, 0, 0]) < 0.05

    scene.run(2.5, compare)
    assert np.mean(values) < 3.0


def test_occluded_track_is_kept_and_vanished_track_ends() -> None:
    pillar = Flatland(discs=[(2.0, 0.0, 0.35)])
    scene = Scene(crossing, walls=pillar).run(1.5)
    assert len(scene.tracker.moving) == 1
    counts = list[int]()
    scene.run(2.5, lambda scene: counts.append(len(scene.tracker.moving)))
    assert min(counts) == max(counts) == 1
    assert scene.tracker.moving.velocities[0] == pytest.approx([0.0, 1.2], abs=0.2)
    scene.discs = lambda _: []
    scene.run(1.0)
    assert len(scene.tracker.moving) == 0


def test_stopped_obstacle_becomes_static() -> None:
    scene = Scene(lambda t: [(4.0, -3.0 + 1.2 * min(t, 2.0), 0.5)]).run(1.8)
    assert len(scene.tracker.moving) == 1
    scene.run(3.0)
    assert len(scene.tracker.moving) == 0


def test_approaching_obstacle_is_reported_before_one_meter() -> None:
    """The obstacle comes head on at 0.45 m/s. Its motion over one second proves this earlier than its current speed."""
    scene = Scene(lambda t: [(4.0 - 0.45 * t, 0.1, 0.22)], view=FULL, beams=360).run(2.5)
    assert len(scene.tracker.moving) == 1
    assert scene.tracker.moving.velocities[0] == pytest.approx([-0.45, 0.0], abs=0.15)


def test_reported_radius_covers_the_body_behind_a_visible_mast() -> None:
    """Three beams with a spacing of one degree hit the mast at two meters."""
    scene = Scene(lambda t: [(4.0 - 0.5 * t, 0.1, 0.06)], view=FULL, beams=360).run(5.0)
    assert len(scene.tracker.moving) == 1
    assert scene.tracker.moving.radii[0] >= 0.25


def test_turning_obstacle_is_reported() -> None:
    """The obstacle moves sideways slowly, so it is not reported at first, and then returns faster."""

    def back_and_forth(t: float) -> list[Disc]:
        return [(4.0, 0.26 * t if t < 4.0 else 1.04 - 1.0 * (t - 4.0), 0.4)]

    scene = Scene(back_and_forth).run(4.8)
    assert len(scene.tracker.moving) == 1
    assert scene.tracker.moving.velocities[0, 1] < -0.5


def test_partly_visible_obstacle_is_reported_after_a_long_distance() -> None:
    """The obstacle moves next to the robot at the same speed, so no beam ever passed through its earlier position."""
    base = lambda t: Pose2(1.5 * t, 0.0)  # noqa: E731
    edge = math.radians(135.0)

    def beside(t: float) -> Disc:
        return (1.5 * t + 3.0 * math.cos(edge), -3.0 * math.sin(edge), 0.5)

    scene = Scene(lambda t: [beside(t), (14.0, 6.0 - 1.2 * t, 0.5)], base).run(4.0)
    assert any(math.dist(center, beside(scene.time)[:2]) < 0.5 for center, _ in reported_motion(scene))


def reported_motion(scene: Scene) -> list[tuple[list[float], list[float]]]:
    """Return center and velocity of each reported obstacle."""
    moving = scene.tracker.moving
    return list(zip(moving.centers.tolist(), moving.velocities.tolist(), strict=True))


def scans_with_motion(scene: Scene, seconds: float) -> int:
    """Return the number of scans with reported motion."""
    reported = list[bool]()
    scene.run(seconds, lambda scene: reported.append(len(scene.tracker.moving) > 0))
    return sum(reported)


def tour(t: float) -> Pose2:
    """Return the pose of a drive through the room that swings by ±70° at up to 2 rad/s."""
    return Pose2(1.5 + 0.6 * t, 3.5 + 0.4 * math.sin(t), 1.2 * math.sin(1.7 * t))


@pytest.mark.parametrize("view, beams", [(FRONT, 720), (FULL, 360)])
def test_no_motion_is_reported_in_a_static_room(view: float, beams: int) -> None:
    assert scans_with_motion(Scene(lambda _: [], tour, walls=static_room(), view=view, beams=beams), 12.0) == 0


@pytest.mark.parametrize("max_range", [3.5, 6.0, 12.0])
@pytest.mark.parametrize("speed", [0.3, 0.5, 0.8, 1.0])
def test_no_motion_is_reported_when_a_wall_comes_into_range(speed: float, max_range: float) -> None:
    """A beam that hits nothing shows free space only up to the maximum range of the lidar."""
    wall = Flatland([(max_range + 1.0, -0.6, max_range + 1.2, 0.6)])
    scene = Scene(lambda _: [], lambda t: Pose2(speed * t, 0.0), walls=wall, max_range=max_range)
    assert scans_with_motion(scene, 6.0) == 0


@pytest.mark.parametrize("view, beams", [(FRONT, 720), (FULL, 360)])
def test_no_motion_is_reported_with_odometry_drift(view: float, beams: int) -> None:
    """The drift is 5 % of the distance and 1 % of each turn, more than with wheels and a gyroscope."""

    def drifted(t: float) -> Pose2:
        pose = tour(t)
        return Pose2(1.05 * pose.x, 1.05 * pose.y, 1.01 * pose.yaw)

    assert scans_with_motion(Scene(lambda _: [], tour, drifted, walls=static_room(), view=view, beams=beams), 12.0) == 0


def test_no_motion_of_posts_is_reported_with_wheel_slip() -> None:
    """Because of the slip, earlier beams seem to have passed through the positions of posts."""
    rng = np.random.default_rng(3)
    posts = Flatland()
    posts.discs += [(x, side * float(rng.uniform(1.2, 4.5)), 0.075) for x in np.arange(-2, 24, 0.3) for side in (-1, 1)]

    def straight(t: float) -> Pose2:
        return Pose2(2.0 * t, 0.0, 0.1 * math.sin(2.0 * t))

    def slipping(t: float) -> Pose2:
        return Pose2(2.2 * t, 0.0, straight(t).yaw)

    assert scans_with_motion(Scene(lambda _: [], straight, walls=posts), 8.0) == 0
    assert scans_with_motion(Scene(lambda _: [], straight, slipping, walls=posts), 8.0) == 0


@pytest.mark.parametrize("gap", [0.4, 0.55, 0.7])
def test_track_of_a_removed_object_does_not_jump_to_a_post(gap: float) -> None:
    """A post is within the gate of the track, which has no speed."""
    posts = Flatland(discs=[(3.0 + 0.05 * k, gap * k, 0.1) for k in range(1, 8)])
    scene = Scene(lambda t: [(3.0, 0.0, 0.1)] if 1.0 <= t < 2.0 else [], walls=posts)
    assert scans_with_motion(scene, 4.0) == 0


def test_no_motion_of_posts_is_reported_when_the_robot_skids() -> None:
    """The robot skids by 0.12 m within 0.5 s and back while it swings, so most posts appear in formerly free space."""
    rng = np.random.default_rng(39)
    posts = Flatland()
    posts.discs += [(x, side * float(rng.uniform(0.4, 2.5)), 0.075) for x in np.arange(-2, 8, 0.2) for side in (-1, 1)]

    def swinging(t: float) -> Pose2:
        return Pose2(1.0 - math.cos(0.4 * t), 0.0, 0.5 * math.sin(1.3 * t))

    def skidding(t: float) -> Pose2:
        pose = swinging(t)
        lateral = float(np.interp(t % 5.0, [0.5, 1.0, 3.0, 3.5], [0.0, 0.12, 0.12, 0.0]))
        return Pose2(1.05 * pose.x, lateral, 1.01 * pose.yaw)

    assert scans_with_motion(Scene(lambda _: [], swinging, skidding, walls=posts), 8.0) == 0


def test_last_segment_of_a_scan_has_the_range_of_its_last_hit() -> None:
    ranges, step = np.array([50.0] * 10 + [2.0, 1.95, 1.9]), 0.01
    segments = find_segments(ranges, ranges * np.exp(1j * step * np.arange(13)), step, 0.1, 10.0)
    (cluster,) = find_clusters(segments, ranges, 0.0, step, 1.0)
    sine = math.sin(1.5 * step)
    assert cluster.radius == pytest.approx(1.9 * sine / (1.0 - sine))
    assert abs(cluster.center) == pytest.approx(1.9 + cluster.radius)


def test_segment_must_contain_the_required_number_of_marked_hits() -> None:
    rng, step, reported = np.random.default_rng(4), math.radians(1.0), list[bool]()
    for _ in range(400):
        ranges = np.repeat(rng.uniform(1.0, 6.0, 18), 4) + rng.normal(0.0, 0.04, 72)
        ranges[rng.random(72) < 0.1] = np.inf
        segments = find_segments(ranges, np.fmin(ranges, 1e5) * np.exp(1j * step * np.arange(72)), step, 0.1, 10.0)
        is_marked = rng.random(len(segments.beams)) < 0.15
        reported.append(segments.has_segment_with(3, is_marked))
        ends = zip(segments.first, segments.last, strict=True)
        assert reported[-1] == any(is_marked[first : last + 1].sum() >= 3 for first, last in ends)
    assert min(reported.count(True), reported.count(False)) > 50


def test_garbage_scan_creates_no_tracks() -> None:
    tracker = Tracker(Prediction(), TICK_RATE_HZ)
    rng = np.random.default_rng(1)
    for k in range(20):
        ranges = rng.uniform(-5, 40, 360)
        ranges[rng.random(360) < 0.3] = np.nan
        tracker.on_scan(
            Scan("lidar", k * 24, ranges[: 360 if k % 3 else k // 3], -3.14, 0.0175, 0.1, 30.0), Pose2(0, 0)
        )
    assert len(tracker.moving) == 0


@pytest.mark.parametrize("visible_rad", [1.2, 1.8, 2.5])
def test_circle_fit_of_an_arc_converges_from_half_a_radius_away(visible_rad: float) -> None:
    """The points are exact and cover `visible_rad` rad of the circle, on the side that faces the origin."""
    middle, radius = 2.0 + 1.0j, 0.3
    direction = math.pi + math.atan2(middle.imag, middle.real)
    arc = [middle + cmath.rect(radius, direction + visible_rad * (k / 14 - 0.5)) for k in range(15)]
    assert abs(fit_circle(arc, radius, middle + cmath.rect(radius / 2, direction + 0.4)) - middle) < CONVERGED_STEP_M


@pytest.mark.filterwarnings("error")
def test_too_close_returns_are_ignored() -> None:
    moving = [Scene(crossing, covered=value).run(3.0).tracker.moving.obstacles for value in (-np.inf, np.nan)]
    assert moving[0] == moving[1] != ()


@pytest.mark.parametrize("degrees", [-180.4, -179.6, 90.2, 179.4, 179.6, 180.0])
def test_full_circle_lidar_with_ranges_behind_a_track_sees_past_the_track(degrees: float) -> None:
    scan = Scan("lidar", 0, np.full(360, 5.0), -math.pi, math.radians(1.0), 0.1, 30.0)
    track = Track.start(0, cmath.rect(2.0, math.radians(degrees)), 0.1, 0.3)
    assert CurrentScan(scan, 5.0 * np.exp(1j * scan.angles()), Pose2(0.0, 0.0), None).sees_past(track)
