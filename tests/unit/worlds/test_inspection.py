"""Tests of the summary of a world."""

import pytest

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Body, Box, Cylinder, Solid
from simscen.worlds.built_world import build_world_and_map, inspect_world

ROOM = World(
    "room",
    (
        Solid(Box((4.0, 0.2, 1.0)), Pose3(0, 2, 0.5), "wall"),
        Solid(Box((4.0, 0.2, 1.0)), Pose3(0, -2, 0.5), "wall"),
        Solid(Cylinder(0.5, 2.0), Pose3(1, 0, 1.0), "post"),
    ),
    bodies=(Body("cart", (Solid(Box((1.0, 0.5, 0.5)), Pose3(z=0.25)),), Pose3(-1, 0, 0), 12.0),),
    places={"dock": Pose2(0, 0, 0)},
    regions={"lane": ((0, 0), (1, 0), (1, 1))},
    bounds=(-2, -2.1, 2, 2.1),
    notes=("a note",),
)


def test_world_summary_has_numbers():
    summary = inspect_world(build_world_and_map(ROOM, 0.3))
    assert [item.name for item in summary.solids] == ["wall", "wall", "post"]
    assert summary.shapes == (("box", 2), ("cylinder", 1))
    assert summary.solids[2].extent == pytest.approx((0.5, -0.5, 0.0, 1.5, 0.5, 2.0))
    assert summary.solids[0].mass is None
    (cart,) = summary.bodies
    assert (cart.shape, cart.mass, cart.triangles) == ("box", 12.0, 12)
    assert cart.extent == pytest.approx((-1.5, -0.25, 0.0, -0.5, 0.25, 0.5))
    assert summary.triangles == sum(item.triangles for item in summary.solids) + 12
    assert (summary.places, summary.regions, summary.notes) == (("dock",), ("lane",), ("a note",))


def test_the_shares_of_the_map_add_up():
    occupied, free, unknown = inspect_world(build_world_and_map(ROOM, 0.3)).map_shares
    assert occupied + free + unknown == pytest.approx(1.0)
    assert occupied == pytest.approx((2 * 4 * 0.2 + 3.14 * 0.25) / (6.0 * 6.2), rel=0.12)
    assert unknown == 0.0


def test_an_empty_world_can_be_inspected():
    summary = inspect_world(build_world_and_map(World("nothing", ()), 0.3))
    assert (summary.solids, summary.bodies, summary.triangles) == ((), (), 0)
