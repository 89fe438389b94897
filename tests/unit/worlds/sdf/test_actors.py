"""Tests of scripted SDF actors."""

import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.motion_paths import MAX_STEP_M, largest_step
from simscen.core.geometry.shapes import Cylinder

SKIN = "<skin><filename>walk.dae</filename></skin>"
BOX = (
    "<link name='l'><collision name='c'><pose>0 0 0.5 0 0 0</pose><geometry><box><size>1 1 1</size></box></geometry>"
    "</collision></link>"
)


def trajectory(points, number=0):
    waypoints = "".join(
        f"<waypoint><time>{t}</time><pose>{x} {y} {z} 0 0 {yaw}</pose></waypoint>" for t, x, y, z, yaw in points
    )
    return f"<trajectory id='{number}' type='walking'>{waypoints}</trajectory>"


def actor(script="", body=SKIN, extra=""):
    return f"<actor name='anna'>{extra}{body}<script>{script}</script></actor>"


WALK = trajectory([(0, 1, 0, 1, 0), (4, 5, 0, 1, 0), (5, 5, 0, 1, 1.5)])


def test_scripted_actor_is_an_unpushable_body_with_a_path(load):
    (body,) = load(actor("<loop>false</loop>" + WALK)).bodies
    assert (body.name, body.mass) == ("anna", 0)
    assert body.path is not None
    assert body.path.times == (0, 4, 5)
    assert body.path.poses[:2] == (Pose2(1, 0, 0), Pose2(5, 0, 0))
    assert body.path.poses[2].yaw == pytest.approx(1.5)
    assert (body.path.mode, body.path.start) == ("once", 0)
    assert body.pose.plane == body.path.poses[0]


def test_skin_is_replaced_by_a_person_on_the_ground(load):
    world = load(actor(WALK))
    (solid,) = world.bodies[0].solids
    assert solid.shape == Cylinder(0.3, 1.8)
    assert world.bodies[0].pose.compose(solid.pose).position == (1, 0, 0.9)
    assert "stands in for its skin" in world.notes[0]


def test_collision_geometry_is_used_if_present(load):
    world = load(actor(WALK, SKIN + BOX))
    (solid,) = world.bodies[0].solids
    assert world.bodies[0].pose.compose(solid.pose).position == (1, 0, 1.5)
    assert not world.notes


def test_scripts_loop_by_default_and_wait_before_each_round(load):
    path = load(actor("<delay_start>2</delay_start>" + WALK)).bodies[0].path
    assert (path.mode, path.start) == ("loop", 0)
    assert path.times == (0, 2, 6, 7)
    assert path.poses[0] == path.poses[1]


def test_a_single_run_waits_once(load):
    path = load(actor("<loop>0</loop><delay_start>2</delay_start>" + WALK)).bodies[0].path
    assert (path.mode, path.start, path.times) == ("once", 2, (0, 4, 5))


def test_trajectories_follow_each_other_by_id(load):
    second = trajectory([(0, 5, 0, 1, 1.5), (3, 5, 6, 1, 1.5)], 1)
    path = load(actor(second + WALK)).bodies[0].path
    assert path.times == (0, 4, 5, 8)
    assert path.poses[-1][:2] == (5, 6)


def test_a_jump_between_trajectories_takes_no_time(load):
    path = load(actor(WALK + trajectory([(0, 9, 9, 1, 0), (3, 5, 6, 1, 0)], 1))).bodies[0].path
    assert path.times == (0, 4, 5, 5, 8)
    assert largest_step(path, 1 / 240) < MAX_STEP_M, "a jump is not a fast motion"


def test_actor_waits_at_its_first_waypoint_until_its_time(load):
    path = load(actor(trajectory([(2, 1, 1, 1, 0), (4, 2, 1, 1, 0)]))).bodies[0].path
    assert path.times == (0, 2, 4)
    assert path.poses[0] == path.poses[1]


@pytest.mark.parametrize("script", ["", "<auto_start>false</auto_start>" + WALK, trajectory([(0, 1, 0, 1, 0)])])
def test_actor_without_a_running_script_is_stationary(load, script):
    world = load(actor(script, extra="<pose>1 0 1 0 0 0</pose>"))
    assert world.bodies[0].path is None
    assert world.bodies[0].pose.plane == Pose2(1, 0, 0)
    assert any("stands still" in note for note in world.notes)


def test_a_path_that_climbs_is_flattened_with_a_note(load):
    world = load(actor(trajectory([(0, 0, 0, 1, 0), (4, 5, 0, 3, 0)])))
    assert any("keeps the height and the tilt" in note for note in world.notes)


def test_actor_whose_script_takes_no_time_stands_at_its_first_waypoint(load):
    points = trajectory([(0, 1, 0, 1, 0)]) + trajectory([(0, 5, 0, 1, 0)], number=1)
    world = load(actor(points))
    assert (world.bodies[0].path, world.bodies[0].pose.plane) == (None, Pose2(1, 0, 0))
    assert any("stands still" in note for note in world.notes)


def test_included_actors_walk(load, tmp_path):
    (tmp_path / "anna.sdf").write_text(f"<sdf version='1.9'>{actor(WALK)}</sdf>")
    (body,) = load("<include><uri>anna.sdf</uri><name>berta</name></include>").bodies
    assert (body.name, body.path.times) == ("berta", (0, 4, 5))


@pytest.mark.parametrize(
    ("script", "message"),
    [
        (trajectory([(-1, 0, 0, 0, 0)]), "a time before the start"),
        (trajectory([("nan", 0, 0, 0, 0)]), "must be a finite number"),
        (WALK.replace("id='0'", "id='first'"), "the id must be a whole number"),
        (WALK.replace("id='0'", f"id='{'1' * 5000}'"), "the id must be a whole number"),
        ("<loop>0</loop><delay_start>-2</delay_start>" + WALK, "must not be negative, got -2"),
    ],
)
def test_invalid_script_is_refused(refuse, script, message):
    assert message in refuse(actor(script))[0].message
