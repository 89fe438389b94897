"""Tests of floors in SDF worlds."""

import pytest


def slab(x, y, z, name="floor", height=0.1):
    size = f"<size>{x} {y} {height}</size>"
    link = f"<link name='a'><collision name='c'><geometry><box>{size}</box></geometry></collision></link>"
    return f"<model name='{name}'><static>1</static><pose>0 0 {z} 0 0 0</pose>{link}</model>"


CRATE = (
    "<model name='crate'><pose>1 1 0.55 0 0 0</pose><link name='a'><collision name='c'><geometry><box>"
    "<size>1 1 1</size></box></geometry></collision></link></model>"
)


def test_everything_is_lowered_by_the_height_of_the_floor_and_a_note_says_so(load):
    world = load(slab(10, 8, 0) + slab(0.2, 8, 1.05, "wall", 2) + CRATE)
    assert [solid.pose.z for solid in world.solids] == pytest.approx([-0.05, 1.0])
    assert world.bodies[0].pose.z == pytest.approx(0.5)
    assert [note.partition("]: ")[2] for note in world.notes] == [
        "its floor is 0.050 m above z = 0; the world is lowered by that height"
    ]


@pytest.mark.parametrize(
    ("content", "places"),
    [
        pytest.param(slab(10, 8, -0.05), [-0.05], id="its top is the ground already"),
        pytest.param(
            slab(4, 4, 0) + slab(0.2, 8, 1, height=2) + slab(10, 0.2, 1, height=2), [0, 1, 1], id="a platform"
        ),
        pytest.param(slab(10, 8, 2), [2], id="a roof"),
        pytest.param(slab(10, 8, -0.4), [-0.4], id="below the ground"),
    ],
)
def test_world_without_a_floor_is_not_moved(load, content, places):
    world = load(content)
    assert [solid.pose.z for solid in world.solids] == places
    assert not world.notes
