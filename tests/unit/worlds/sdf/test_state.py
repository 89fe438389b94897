"""Tests of the saved state of SDF worlds."""

import pytest

from simscen.core.geometry.shapes import Box, Cylinder, Sphere

BOX = "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>"


def model(name="m", content=f"<link name='a'>{BOX}</link>", extra="<static>1</static>"):
    return f"<model name='{name}'>{extra}<pose>1 0 0 0 0 0</pose>{content}</model>"


def state(content):
    return f"<state world_name='w'><sim_time>1 0</sim_time>{content}</state>"


def x_positions(world):
    return [round(solid.pose.x, 9) for solid in world.solids]


def test_saved_pose_replaces_that_of_the_model(load):
    assert x_positions(load(model() + state("<model name='m'><pose>7 0 0 0 0 0</pose></model>"))) == [7]


def test_a_saved_link_pose_is_a_world_pose(load):
    saved = "<model name='m'><pose>7 0 0 0 0 0</pose><link name='a'><pose>9 0 0 0 0 0</pose></link></model>"
    assert x_positions(load(model() + state(saved))) == [9]


def test_saved_poses_of_nested_models_are_world_poses(load):
    nested = model("n", f"<link name='a'>{BOX}</link><link name='b'>{BOX}</link>")
    inner = "<pose>3 0 0 0 0 0</pose><link name='b'><pose>4 0 0 0 0 0</pose></link>"
    saved = f"<model name='m'><pose>7 0 0 0 0 0</pose><model name='n'>{inner}</model></model>"
    assert x_positions(load(model("m", nested) + state(saved))) == [3, 4]
    assert x_positions(load(model("m", nested) + state("<model name='m'><pose>7 0 0 0 0 0</pose></model>"))) == [8, 8]


def test_older_worlds_name_links_of_nested_models_with_colons(load):
    saved = "<model name='m'><link name='n::a'><pose>5 0 0 0 0 0</pose></link></model>"
    assert x_positions(load(model("m", model("n")) + state(saved))) == [5]


def test_included_models_are_moved_by_their_name(load, tmp_path):
    (tmp_path / "crate.sdf").write_text(f"<sdf version='1.6'>{model('crate')}</sdf>")
    include = "<include><uri>crate.sdf</uri><name>left</name></include>"
    assert x_positions(load(include + state("<model name='left'><pose>6 0 0 0 0 0</pose></model>"))) == [6]


def test_insertions_and_deletions_are_applied(load):
    changes = f"<insertions>{model('new')}</insertions><deletions><name>m</name></deletions>"
    world = load(model() + state(changes + "<model name='new'><pose>2 0 0 0 0 0</pose></model>"))
    assert [(solid.name, solid.pose.x) for solid in world.solids] == [("new::a::c", 2)]


def test_movable_models_start_at_their_saved_pose(load):
    world = load(model(extra="") + state("<model name='m'><pose>7 0 0 0 0 0</pose></model>"))
    assert world.bodies[0].pose.x == 7


def test_states_of_unknown_models_are_ignored(load):
    assert x_positions(load(model() + state("<model name='gone'><pose>7 0 0 0 0 0</pose></model>"))) == [1]


def test_only_the_first_state_counts(load):
    text = "".join(state(f"<model name='m'><pose>{x} 0 0 0 0 0</pose></model>") for x in (2, 3))
    world = load(model() + text)
    assert x_positions(world) == [2]
    assert "only the first <state>" in world.notes[0]


@pytest.mark.parametrize(
    ("saved", "message"),
    [
        ("<model name='m'><scale>2 0 1</scale></model>", "a scale must be positive, got 2 0 1"),
        ("<model name='m'><pose>x</pose></model>", "expected 6 numbers"),
    ],
)
def test_inapplicable_state_is_an_error(refuse, saved, message):
    assert message in refuse(model() + state(saved))[0].message


@pytest.mark.parametrize(
    ("geometry", "expected"),
    [
        ("<box><size>1 2 3</size></box>", Box((2.0, 6.0, 12.0))),
        ("<cylinder><radius>1</radius><length>2</length></cylinder>", Cylinder(2.0, 8.0)),
        ("<sphere><radius>1</radius></sphere>", Sphere(2.0)),
    ],
)
def test_saved_scale_multiplies_sizes_but_not_positions(load, geometry, expected):
    shape = f"<collision name='c'><pose>0.5 0 0 0 0 0</pose><geometry>{geometry}</geometry></collision>"
    world = load(
        model(content=f"<link name='a'>{shape}</link>") + state("<model name='m'><scale>2 3 4</scale></model>")
    )
    (solid,) = world.solids
    assert solid.shape == expected
    assert solid.pose.position == (1.5, 0, 0)


def test_state_in_a_model_is_ignored_with_a_note(load):
    state = "<state world_name='w'><model name='m'><pose>5 0 0 0 0 0</pose><scale>3 3 3</scale></model></state>"
    world = load(f"<model name='m'><static>1</static><link name='a'>{BOX}</link>{state}</model>")
    assert [solid.pose.x for solid in world.solids] == [0]
    assert [note.partition("/state: ")[2] for note in world.notes] == [
        "ignored: only the <state> of a world is applied"
    ]
