"""Tests of floors in SDF worlds."""

import pytest


def slab(x, y, z, name="floor", height=0.1, xy="0 0"):
    size = f"<size>{x} {y} {height}</size>"
    link = f"<link name='a'><collision name='c'><geometry><box>{size}</box></geometry></collision></link>"
    return f"<model name='{name}'><static>1</static><pose>{xy} {z} 0 0 0</pose>{link}</model>"


GROUND = "<include><uri>model://ground_plane</uri></include>"


CRATE = (
    "<model name='crate'><pose>1 1 0.55 0 0 0</pose><link name='a'><collision name='c'><geometry><box>"
    "<size>1 1 1</size></box></geometry></collision></link></model>"
)


def test_world_is_lowered_by_the_height_of_the_floor_with_a_note(load):
    world = load(slab(10, 8, 0) + slab(0.2, 8, 1.05, "wall", 2) + CRATE)
    assert [solid.pose.z for solid in world.solids] == pytest.approx([-0.05, 1.0])
    assert world.bodies[0].pose.z == pytest.approx(0.5)
    assert [note.partition("]: ")[2] for note in world.notes] == [
        "its floor is 0.050 m above z = 0; the world is lowered by that height"
    ]


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(GROUND + slab(10, 8, 0) + CRATE, id="a covering on a ground plane"),
        pytest.param(GROUND + slab(10, 8, 0) + slab(0.2, 8, 1, height=2, xy="5.5 0"), id="a wall beside a covering"),
        pytest.param(slab(20, 20, 0), id="a wide plate"),
        pytest.param(slab(2, 2, 0) + slab(0.1, 2, 0.5, height=0.9), id="a plate that carries a wall"),
        pytest.param(slab(5, 8, 0, xy="-2.5 0") + slab(5, 8, 0, xy="2.5 0") + CRATE, id="tiles"),
    ],
)
def test_slab_that_supports_everything_is_the_floor(load, content):
    world = load(content)
    assert world.solids[0].pose.z == pytest.approx(-0.05)
    assert len(world.notes) == 1


@pytest.mark.parametrize(
    ("content", "heights"),
    [
        pytest.param(slab(10, 8, -0.05), [-0.05], id="a plate with its top at z = 0"),
        pytest.param(
            slab(4, 4, 0) + slab(0.2, 8, 1, height=2) + slab(10, 0.2, 1, height=2), [0, 1, 1], id="a platform"
        ),
        pytest.param(slab(10, 8, 2), [2], id="a roof"),
        pytest.param(slab(10, 8, 0).replace("<static>1</static>", "") + slab(1, 1, 0.5), [0.5], id="a movable plate"),
        pytest.param(slab(10, 8, -0.4), [-0.4], id="below the ground"),
        pytest.param(GROUND + slab(1, 4, 0.1, height=0.2), [0.1], id="a block on a ground plane"),
        pytest.param(slab(1, 4, 0.1, height=0.2), [0.1], id="a block without a ground plane"),
        pytest.param(GROUND + slab(2, 0.3, 0.025, height=0.05), [0.025], id="a curb on a ground plane"),
        pytest.param(
            GROUND + slab(10, 6, 0.125, height=0.25) + slab(0.2, 6, 0.1, height=0.2, xy="-5.6 0"),
            [0.125, 0.1],
            id="a stage and a curb on a ground plane",
        ),
        pytest.param(
            GROUND + slab(10, 6, 0.125, height=0.25) + slab(1, 1, 0.75, height=1),
            [0.125, 0.75],
            id="a stage with a crate on a ground plane",
        ),
        pytest.param(
            GROUND + slab(8, 10, 0) + slab(10, 0.1, 0.5, height=1, xy="1 5"),
            [0, 0.5],
            id="a thin slab next to ground on which robots can drive",
        ),
        pytest.param(
            slab(6, 6, 0) + slab(6, 6, 0) + slab(0.1, 8, 1, height=2, xy="8 0"),
            [0, 0, 1],
            id="two tiles in the same place",
        ),
    ],
)
def test_world_without_a_floor_is_not_moved(load, content, heights):
    world = load(content)
    assert [solid.pose.z for solid in world.solids] == heights
    assert not world.notes


def test_floor_too_large_for_a_map_is_not_part_of_the_bounds(load):
    world = load(slab(199, 199, 0) + slab(0.2, 2, 0.55, "wall", 1, xy="3 0"))
    assert world.bounds == pytest.approx((2.9, -1, 3.1, 1))
    assert world.has_open_ground
    assert [solid.pose.z for solid in world.solids] == pytest.approx([-0.05, 0.5])


def test_tiles_whose_union_is_too_large_for_a_map_are_not_part_of_the_bounds(load):
    tiles = [slab(100, 100, 0, f"tile{k}", xy=f"{100 * (k % 3)} {100 * (k // 3)}") for k in range(9)]
    world = load("".join(tiles) + slab(0.2, 2, 0.55, "wall", 1, xy="3 0"))
    assert world.bounds == pytest.approx((2.9, -1, 3.1, 1))
    assert len(world.solids) == 10


def test_floor_of_a_common_size_is_part_of_the_bounds(load):
    world = load(slab(10, 8, 0) + slab(0.2, 2, 0.55, "wall", 1, xy="3 0"))
    assert world.bounds == pytest.approx((-5, -4, 5, 4))
    assert not world.has_open_ground


def test_building_that_is_too_large_for_a_map_is_not_skipped_as_distant(load):
    world = load(GROUND + slab(500, 500, 1, "hall", 2) + slab(1, 1, 0.5, "crate", 1, xy="9 0"))
    assert len(world.solids) == 2
    assert not world.notes
