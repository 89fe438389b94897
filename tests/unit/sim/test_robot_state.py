"""Tests of the state of a robot, which is read once per tick."""

import pybullet

from simscen.core.geometry import Pose2


def test_pose_is_read_from_the_engine_once_per_tick(simulate, monkeypatch):
    simulation, calls = simulate(drive=(0.3, 0.0, 0.2)), []
    simulation.truth()
    real = pybullet.getBasePositionAndOrientation
    monkeypatch.setattr(
        "pybullet.getBasePositionAndOrientation", lambda *args, **options: calls.append(args) or real(*args, **options)
    )
    for _ in range(10):
        simulation.step(6)
        truth = simulation.truth()
        assert simulation.base_pose() == truth.pose
        assert simulation.robot.state().twist == truth.twist
        simulation.robot.base_velocity()
    assert len(calls) == 10


def test_placed_robot_has_its_new_pose_within_the_same_tick(simulate):
    simulation = simulate(drive=(0.3, 0.0, 0.0))
    simulation.step(120)
    assert simulation.robot.base_velocity()[0][0] > 0.1
    simulation.place_robot(Pose2(2.0, 1.0, 0.5))
    assert simulation.base_pose().plane.distance(Pose2(2.0, 1.0)) < 1e-6
    assert abs(simulation.robot.base_velocity()[0][0]) < 1e-9
