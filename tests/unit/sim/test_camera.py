"""Tests of color and depth images."""

import math

import numpy as np
from simulation_helpers import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body, MotionPath

FIELD_OF_VIEW_RAD, WIDTH, HEIGHT = 1.2, 64, 48


def render(simulation, mount=Pose3(z=0.5)):
    return simulation.robot.image(mount, WIDTH, HEIGHT, FIELD_OF_VIEW_RAD, 10.0)


def test_depth_of_a_facing_wall_is_its_distance_in_every_pixel(simulate):
    rgb, depth = render(simulate(solids=[box("wall", 2.05, 0, 0.1, 9, 5)]))
    assert rgb.shape == (HEIGHT, WIDTH, 3) and rgb.dtype == np.uint8
    assert depth.shape == (HEIGHT, WIDTH) and depth.dtype == np.float32
    assert np.allclose(depth[: HEIGHT // 2], 2.0, atol=0.01)


def test_depth_without_a_hit_is_infinite(simulate):
    _, depth = render(simulate())
    assert np.isinf(depth[: HEIGHT // 2 - 2]).all()


def test_field_of_view_is_horizontal(simulate):
    post = box("post", 2.0 + 0.01, 2.0 * math.tan(FIELD_OF_VIEW_RAD / 4), 0.02, 0.1, 3)
    _, depth = render(simulate(solids=[post]))
    columns = np.flatnonzero(np.isfinite(depth[5]))
    # Halfway to the left edge in angle; the image is straight in the tangent.
    expected = WIDTH / 2 * (1 - math.tan(FIELD_OF_VIEW_RAD / 4) / math.tan(FIELD_OF_VIEW_RAD / 2))
    assert abs(columns.mean() - expected) < 1.5


def test_camera_facing_left_sees_the_wall_on_the_left(simulate):
    simulation = simulate(solids=[box("wall", 0, 3.05, 9, 0.1, 5)])
    _, depth = render(simulation, Pose3.from_rpy(0, 0, 0.5, 0, 0, math.pi / 2))
    assert np.allclose(depth[:20], 3.0, atol=0.02)


def test_camera_sees_scripted_bodies_at_their_current_pose(simulate):
    path = MotionPath((0.0, 1.0), (Pose2(5, 0), Pose2(3, 0)))
    simulation = simulate(bodies=[Body("cart", (box("cart", 0, 0, 0.2, 2, 2),), Pose3(5), path=path)])
    simulation.step(240)
    assert abs(render(simulation)[1][10, WIDTH // 2] - 2.9) < 0.02


def test_two_images_of_the_same_scene_are_equal(simulate):
    simulation = simulate(solids=[box("wall", 2, 0.5, 0.1, 1)])
    (rgb, depth), (rgb_again, depth_again) = render(simulation), render(simulation)
    assert (rgb == rgb_again).all() and (depth == depth_again).all()


def test_camera_does_not_change_the_motion(simulate):
    path = MotionPath((0.0, 1.0), (Pose2(5, 0), Pose2(3, 0)))
    cart = Body("cart", (box("cart", 0, 0, 0.2, 2, 2),), Pose3(5), path=path)
    with_images, without_images = (
        simulate(solids=[box("wall", 1.5, 0.5, 0.1, 1)], bodies=[cart], drive=(0.5, 0.0, 0.3), has_images=has_images)
        for has_images in (True, False)
    )
    for _ in range(60):
        with_images.step(6)
        without_images.step(6)
        assert (
            with_images.truth() == without_images.truth()
            and with_images.robot.collisions() == without_images.robot.collisions()
        )
