"""The worlds of `simscen bench worlds` are what its table says, and can be driven."""

import pytest

from simscen.bench.speed.large_worlds import MOVABLE, MOVING, STANDING, write_arena, write_hall, write_warehouse
from simscen.loading.builders import load_world
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare


def test_the_hall_holds_its_movable_meshes_and_a_way_past_them(tmp_path):
    file = write_hall(tmp_path / "hall")
    prepared = prepare(load_scenario(file, file.parent))
    bodies = prepared.built.world.bodies
    assert len(bodies) == MOVABLE
    assert all(body.mass > 0 and len(body.solids[0].shape.faces) == 432 for body in bodies)
    assert None not in prepared.case.shortest.values()


def test_the_arena_is_a_hundred_meters_wide_and_its_goals_can_be_reached(tmp_path):
    file = write_arena(tmp_path / "arena")
    prepared = prepare(load_scenario(file, file.parent))
    cells = prepared.built.map
    assert cells.resolution * cells.cells.shape[1] == pytest.approx(100.0)
    assert all(length is not None and length < 100 for length in prepared.case.shortest.values())


@pytest.mark.slow
def test_the_warehouse_holds_five_thousand_objects_of_which_twenty_move(tmp_path):
    file = write_warehouse(tmp_path / "warehouse")
    world = load_world(load_scenario(file, file.parent))
    assert (len(world.solids), len(world.bodies)) == (STANDING + 4, MOVING)  # and four walls
    assert all(body.path is not None for body in world.bodies)
