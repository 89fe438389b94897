"""Tests of sleeping objects."""

import math

import pybullet
import pytest
from simulation_helpers import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, MotionPath, Solid, Sphere
from simscen.sim.objects.rest import RestDetector

CRATE = (box("crate", 0, 0, 0.4, 0.4, 0.4),)
BALL = (Solid(Sphere(0.1), Pose3(z=0.1), "ball"),)
SETTLING_TICKS = 5 * 240
"""Number of ticks after which all resting objects are asleep."""


def run(simulation, ticks, every=6):
    for _ in range(ticks // every):
        simulation.step(every)
        simulation.truth()


def engine_position(simulation, name):
    """Return the position of the center of mass of an object in the engine."""
    number = simulation._scene.actors._actors[name].id
    return pybullet.getBasePositionAndOrientation(number, physicsClientId=simulation._scene.client)[0]


def test_resting_object_does_not_creep(simulate):
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(2.0), 5.0)])
    run(simulation, SETTLING_TICKS)
    before = simulation.object_pose("crate")
    run(simulation, 20 * 240)
    assert simulation.object_pose("crate") == before


def test_resting_object_sleeps_from_the_first_tick(simulate):
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(2.0), 5.0), Body("ball", BALL, Pose3(3.0), 1.0)])
    before = engine_position(simulation, "crate"), engine_position(simulation, "ball")
    run(simulation, 60)
    assert (engine_position(simulation, "crate"), engine_position(simulation, "ball")) == before


def test_unstable_object_tips_over(simulate):
    """The plank leans 0.2 mrad beyond its balance. It moves at less than 1 mm/s for the first quarter of a second."""
    plank, lean = (box("plank", 0, 0, 0.2, 0.2, 2.0),), math.atan2(0.1, 1.0) + 2e-4
    pose = Pose3.from_rpy(3.0, 0.0, 0.1 * math.sin(lean), 0.0, lean, 0.0)
    simulation = simulate(bodies=[Body("plank", plank, pose, 5.0)])
    run(simulation, SETTLING_TICKS)
    assert simulation.object_pose("plank").apply([[0.0, 0.0, 2.0]])[0, 2] < 0.5


@pytest.mark.parametrize(
    ("speeds", "is_resting"),
    [
        ([4e-5, 1e-5, 9e-5, 8e-5, 9e-5], True),
        ([1e-5, 2e-5, 3e-5, 4e-5, 5e-5], False),
        ([2e-3, 1e-3, 5e-4, 1e-4, 5e-5], False),
        ([0.0, 0.0, 0.0, 0.0, 0.0], True),
    ],
)
def test_resting_object_is_slow_and_not_accelerating_at_each_check(monkeypatch, speeds, is_resting):
    remaining_speeds = iter(speeds)
    monkeypatch.setattr(pybullet, "getBaseVelocity", lambda *_: ((next(remaining_speeds), 0.0, 0.0), (0.0, 0.0, 0.0)))
    detector = RestDetector(0, [7])
    for _ in speeds:
        detector.sample()
    assert detector.resting_ids() == ({7} if is_resting else set())


def test_slowly_rolling_object_keeps_rolling(simulate):
    """Bullet's own threshold would stop a ball of 0.1 m/s after two seconds."""
    simulation = simulate(bodies=[Body("ball", BALL, Pose3(2.0), 1.0)])
    run(simulation, SETTLING_TICKS)
    simulation.spawn(Body("other", CRATE, Pose3(-5.0)))  # a change wakes all objects
    run(simulation, 6)
    number = simulation._scene.actors._actors["ball"].id
    pybullet.resetBaseVelocity(number, (0.1, 0, 0), (0, 1.0, 0), physicsClientId=simulation._scene.client)
    run(simulation, SETTLING_TICKS)
    assert engine_position(simulation, "ball")[0] == pytest.approx(2.5, abs=0.02)


def test_slow_robot_wakes_and_pushes_a_sleeping_object(simulate):
    simulation = simulate("amr", bodies=[Body("crate", CRATE, Pose3(1.2), 3.0)])
    run(simulation, SETTLING_TICKS)
    before = simulation.object_pose("crate").x
    simulation.drive(Twist(0.1, 0.0, 0.0))
    run(simulation, 12 * 240)
    assert simulation.object_pose("crate").x > before + 0.2


def test_sleeping_poses_equal_those_of_the_engine(simulate):
    simulation = simulate("amr", bodies=[Body("crate", CRATE, Pose3(1.6), 3.0)])
    run(simulation, SETTLING_TICKS)
    for tick in range(0, 8 * 240, 6):
        if tick == 240:
            simulation.drive(Twist(0.4, 0.0, 0.0))
        simulation.step(6)
        x, y, _ = engine_position(simulation, "crate")
        pose = simulation.truth().objects["crate"]
        center = pose.apply([[0.0, 0.0, 0.2]])[0]
        assert center[:2] == pytest.approx([x, y], abs=1e-6)
    assert x > 1.65


@pytest.mark.parametrize("is_sampled", [True, False])
def test_object_falls_when_its_support_is_removed(simulate, is_sampled):
    upper = Body("upper", CRATE, Pose3(2.0, 0.0, 0.4), 2.0)
    simulation = simulate(bodies=[Body("lower", CRATE, Pose3(2.0), 5.0), upper])
    run(simulation, SETTLING_TICKS)
    assert simulation.object_pose("upper").z == pytest.approx(0.4, abs=2e-3)
    simulation.remove("lower")
    if is_sampled:
        simulation.truth()
    run(simulation, 240)
    assert simulation.object_pose("upper").z == pytest.approx(0.0, abs=2e-3)


def test_scripted_cart_pushes_a_sleeping_object(simulate):
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(3.0), 3.0), Body("cart", CRATE, Pose3(2.0))])
    run(simulation, SETTLING_TICKS)
    simulation.move("cart", MotionPath((0.0, 4.0), (Pose2(2.0, 0.0, 0.0), Pose2(4.0, 0.0, 0.0))))
    run(simulation, 5 * 240)
    assert simulation.object_pose("crate").x > 4.3


def test_object_placed_on_a_sleeping_one_wakes_it(simulate):
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(2.0), 0.5)])
    run(simulation, SETTLING_TICKS)
    simulation.spawn(Body("anvil", CRATE, Pose3(2.3, 0.0, 0.5), 50.0))
    run(simulation, 240)
    assert simulation.object_pose("crate") != Pose3(2.0)
    assert simulation.object_pose("anvil").z < 0.35


FAR_CART = Body("far cart", CRATE, Pose3(-8.0), path=MotionPath((0.0, 60.0), (Pose2(-8, 0), Pose2(-8, 6))))


def test_object_sleeps_while_a_script_moves_a_distant_object(simulate):
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(2.0), 5.0), FAR_CART])
    run(simulation, SETTLING_TICKS)
    before = engine_position(simulation, "crate")
    run(simulation, 20 * 240)
    assert engine_position(simulation, "crate") == before
    assert simulation.object_pose("far cart").y == pytest.approx(2.5)


@pytest.mark.parametrize("start", [0.0, 8.0])
def test_cart_that_arrives_or_starts_beside_a_sleeping_object_pushes_it(simulate, start):
    """With `start` 8 s, the cart waits beside the crate first."""
    first = Pose2(2.58 if start else -1.0, 3.0)
    path = MotionPath((0.0, 8.0), (first, Pose2(4.0, 3.0)), start=start)
    cart = Body("cart", CRATE, Pose3(*path.poses[0][:2]), path=path)
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(3.0, 3.0), 3.0), cart, FAR_CART])
    run(simulation, round((start + 8.5) * 240))
    sliding = (4.0 - first.x) ** 2 / 8.0**2 / (2 * 0.6 * 9.81)
    assert simulation.object_pose("crate").x == pytest.approx(4.4 + sliding, abs=0.01)


def test_stack_pushed_at_its_bottom_moves_as_a_whole(simulate):
    cart = Body("cart", CRATE, Pose3(-1.0), path=MotionPath((0.0, 20.0), (Pose2(-1, 3), Pose2(4, 3))))
    stack = [Body(f"crate{k}", CRATE, Pose3(3.0, 3.0, 0.4 * k), 3.0) for k in range(3)]
    simulation = simulate(bodies=[*stack, cart])
    run(simulation, 22 * 240)
    assert [simulation.object_pose(f"crate{k}").x for k in range(3)] == pytest.approx([4.4] * 3, abs=0.05)


def test_pushed_object_pushes_another_one(simulate):
    cart = Body("cart", CRATE, Pose3(-1.0), path=MotionPath((0.0, 20.0), (Pose2(-1, 3), Pose2(4, 3))))
    row = [Body(f"crate{k}", CRATE, Pose3(3.0 + 0.5 * k, 3.0), 3.0) for k in range(3)]
    simulation = simulate(bodies=[*row, cart])
    run(simulation, 22 * 240)
    assert [simulation.object_pose(f"crate{k}").x for k in range(3)] == pytest.approx([4.4, 4.8, 5.2], abs=0.03)


def test_object_falls_when_a_script_moves_its_support(simulate):
    """The drawer is pulled out after all objects fell asleep, faster than the crate on it could follow."""
    path = MotionPath((0.0, 0.1), (Pose2(2.0, 3.0), Pose2(4.0, 3.0)), start=6.0)
    drawer = Body("drawer", CRATE, Pose3(2.0, 3.0), path=path)
    simulation = simulate(bodies=[Body("crate", CRATE, Pose3(2.0, 3.0, 0.4), 2.0), drawer, FAR_CART])
    run(simulation, 5 * 240)
    assert simulation.object_pose("crate").z == pytest.approx(0.4, abs=2e-3)
    run(simulation, 3 * 240)
    assert simulation.object_pose("crate").z == pytest.approx(0.0, abs=5e-3)


def test_object_is_pushed_away_by_a_scripted_placement(simulate):
    """The path of the cart jumps to the crate."""
    path = MotionPath((0.0, 1.0, 1.0, 2.0), (Pose2(-6, 3), Pose2(-6, 3), Pose2(2.3, 3), Pose2(2.3, 3)), start=6.0)
    simulation = simulate(
        bodies=[Body("crate", CRATE, Pose3(2.0, 3.0), 2.0), Body("cart", CRATE, Pose3(-6, 3), path=path)]
    )
    run(simulation, 10 * 240)
    assert simulation.object_pose("crate").x < 1.95


def test_ball_rolls_through_the_former_place_of_a_cart(simulate):
    """The engine must have the current pose of the cart, not the pose at the time when an object last came near."""
    path = MotionPath((0.0, 4.0, 8.0, 9.0), (Pose2(3, 3), Pose2(3, 9), Pose2(3, 9), Pose2(3, 9)))
    ball = Body("ball", BALL, Pose3(1.0, 3.0), 1.0)
    simulation = simulate(bodies=[ball, Body("cart", CRATE, Pose3(3.0, 3.0), path=path)])
    run(simulation, 4 * 240)
    simulation.push_object("ball", (1.0, 0.0))
    run(simulation, 4 * 240)
    assert engine_position(simulation, "ball")[0] > 3.5
