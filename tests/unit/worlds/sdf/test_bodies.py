"""Tests of the bodies and static solids of SDF models."""

import numpy as np
import pytest

from simscen.worlds.sdf.bodies import LinkGroups

BOX = "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>"


def link(name, x=0.0, mass=None, extra="", collision=BOX):
    inertial = f"<inertial><mass>{mass}</mass></inertial>" if mass is not None else ""
    return f"<link name='{name}'><pose>{x} 0 0 0 0 0</pose>{inertial}{collision}{extra}</link>"


def joint(parent, child, kind="revolute", name="j"):
    return f"<joint name='{name}' type='{kind}'><parent>{parent}</parent><child>{child}</child></joint>"


def model(content, name="cart", extra=""):
    return f"<model name='{name}'>{extra}{content}</model>"


def test_a_free_model_is_a_body_with_its_name_frame_and_mass(load):
    world = load(model(link("a", 1, 3), extra="<pose>0 2 1 0 0 0</pose>"))
    (body,) = world.bodies
    assert (body.name, body.mass, body.path) == ("cart", 3, None)
    assert body.pose.position == (0, 2, 1)
    assert body.pose.compose(body.solids[0].pose).position == (1, 2, 1)


def test_links_on_a_fixed_joint_are_one_body_with_both_masses(load):
    (body,) = load(model(link("a", 0, 1) + link("b", 4, 3) + joint("a", "b", "fixed"))).bodies
    assert body.mass == 4
    assert [solid.pose.x for solid in body.solids] == [0, 4]
    assert not load(model(link("a") + link("b", 4) + joint("a", "b", "fixed"))).notes


def test_a_long_chain_of_links_is_one_body():
    groups, count = LinkGroups(), 50_000
    for number in reversed(range(1, count)):
        groups.join(number - 1, number)
    assert {groups.root(number) for number in range(count)} == {0}


def test_movable_joints_are_held_rigid_with_a_note(load):
    world = load(model(link("a") + link("b", 4) + joint("a", "b")))
    assert len(world.bodies) == 1
    assert world.notes == ("shop.world: world[w]/model[cart]/joint[j]: a joint of type revolute is treated as fixed",)


def test_links_without_a_joint_are_separate_bodies(load):
    bodies = load(model(link("a") + link("b", 4), extra="<pose>1 0 0 0 0 0</pose>")).bodies
    assert [(body.name, body.pose.x) for body in bodies] == [("cart::a", 1), ("cart::b", 5)]


def test_link_attached_to_the_world_is_fixed(load):
    door = link("frame") + link("panel", 1) + joint("world", "frame", "fixed", "f") + joint("frame", "panel")
    world = load(model(door))
    assert [solid.name for solid in world.solids] == ["cart::frame::c", "cart::panel::c"]
    assert not world.bodies
    assert "treated as fixed" in world.notes[0]


def test_link_attached_to_a_static_link_is_fixed(load):
    nested = f"<model name='post'><static>1</static>{link('p')}</model>"
    world = load(model(nested + link("a", 3) + joint("post::p", "a")))
    assert (len(world.solids), len(world.bodies)) == (2, 0)


def test_joints_may_name_frames_and_nested_models(load):
    nested = f"<model name='arm'>{link('tip', 5)}</model><frame name='mount' attached_to='base'/>"
    (body,) = load(model(link("base") + nested + joint("mount", "arm", "fixed"))).bodies
    assert body.mass == 2


def test_joint_attaches_only_the_named_one_of_two_copies_of_a_file(load, tmp_path):
    (tmp_path / "wheel.sdf").write_text(f"<sdf version='1.9'><model name='wheel'>{link('hub')}</model></sdf>")
    wheels = "".join(
        f"<include><uri>wheel.sdf</uri><name>{name}</name><pose>{x} 0 0 0 0 0</pose></include>"
        for name, x in (("left", 0), ("right", 3))
    )
    world = load(model(link("base", 9) + wheels + joint("base", "left::hub", "fixed")))
    assert [(body.name, body.mass) for body in world.bodies] == [("cart::base", 2), ("cart::right::hub", 1)]


def test_nested_models_of_a_static_model_are_static(load):
    inner = f"<model name='n'><static>false</static>{link('a')}</model>"
    world = load(model(inner, extra="<static>TRUE</static>"))
    assert (len(world.solids), len(world.bodies)) == (1, 0)


def test_kinematic_link_is_moved_only_by_the_scenario(load):
    assert load(model(link("a", extra="<kinematic>1</kinematic>"))).bodies[0].mass == 0


def test_a_link_without_collision_adds_its_mass_only(load):
    (body,) = load(model(link("a", 0, 1) + link("motor", 2, 1, collision="") + joint("a", "motor", "fixed"))).bodies
    assert (body.mass, len(body.solids)) == (2, 1)


def test_mass_from_density(load):
    inertial = "<inertial auto='true'><density>500</density></inertial>"
    (body,) = load(model(f"<link name='a'>{inertial}{BOX.replace('1 1 1', '1 2 3')}</link>")).bodies
    assert body.mass == pytest.approx(3000)
    shape = "<cone><radius>0.5</radius><length>2</length></cone>"
    cone = f"<collision name='c'><density>1200</density><geometry>{shape}</geometry></collision>"
    (body,) = load(model(f"<link name='a'>{inertial}{cone}</link>")).bodies
    assert body.mass == pytest.approx(1200 * np.pi * 0.25 * 2 / 3, rel=0.01)


@pytest.mark.parametrize("mass", ["0", "-1", "nan", "heavy"])
def test_invalid_mass_is_refused(refuse, mass):
    (problem,) = refuse(model(link("a", 0, mass)))
    assert "/inertial/mass: " in problem.message


@pytest.mark.parametrize("mass", ["0", "-1", "nan"])
def test_the_mass_of_a_static_model_is_not_read(load, mass):
    world = load(f"<model name='wall'><static>1</static>{link('a', 0, mass)}</model>")
    assert (len(world.solids), world.bodies) == (1, ())


def test_joints_to_missing_links_are_refused(refuse):
    assert "unknown link or frame 'b'" in refuse(model(link("a") + joint("a", "b")))[0].message
    assert "<parent> is missing" in refuse(model(link("a") + "<joint name='j'><child>a</child></joint>"))[0].message


def test_bodies_with_the_same_name_get_numbers(load):
    world = load(model(link("a")) + model(link("a"), "Cart"))
    assert [body.name for body in world.bodies] == ["cart", "Cart_1"]
    assert "is already used" in world.notes[0]


def test_more_than_2000_bodies_are_refused(refuse):
    text = "".join(model(link("a", k), f"m{k}") for k in range(2001))
    assert "more than 2000 bodies" in refuse(text)[0].message


def test_order_is_that_of_the_document(load):
    text = model(f"<model name='n'>{link('x')}</model>" + link("a", 3), extra="<static>1</static>") + model(
        link("z"), "b"
    )
    assert [solid.name for solid in load(text).solids] == ["cart::n::x::c", "cart::a::c"]


def test_too_heavy_body_is_refused_unless_static(load, refuse):
    heavy = model(link("a", 1, "1e12"))
    (problem,) = refuse(heavy)
    assert "model[cart]/link[a]: has a mass of 1e+12 kg; at most 1e+06 kg can move" in problem.message
    assert load(heavy, lenient=True).bodies[0].mass == 0
    assert len(load(model(link("a", 1, "1e12"), extra="<static>1</static>")).solids) == 1
