"""Tests of the worlds of `simscen bench worlds`."""

import pytest

from simscen.bench.speed.large_worlds import (
    MOVABLE_COUNT,
    MOVING_COUNT,
    STATIC_COUNT,
    write_arena,
    write_hall,
    write_warehouse,
)
from simscen.loading.builders import load_world
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare


def test_hall_has_movable_meshes_and_reachable_goals(tmp_path):
    file = write_hall(tmp_path / "hall")
    prepared = prepare(load_scenario(file, file.parent))
    bodies = prepared.built.world.bodies
    assert len(bodies) == MOVABLE_COUNT
    assert all(body.mass > 0 and len(body.solids[0].shape.faces) == 432 for body in bodies)
    assert None not in prepared.case.shortest.values()


def test_arena_is_100_m_wide_and_its_goals_are_reachable(tmp_path):
    file = write_arena(tmp_path / "arena")
    prepared = prepare(load_scenario(file, file.parent))
    grid = prepared.built.map
    assert grid.resolution * grid.cells.shape[1] == pytest.approx(100.0)
    assert all(length is not None and length < 100 for length in prepared.case.shortest.values())


@pytest.mark.slow
def test_warehouse_has_5000_objects_and_20_move(tmp_path):
    file = write_warehouse(tmp_path / "warehouse")
    world = load_world(load_scenario(file, file.parent))
    assert (len(world.solids), len(world.bodies)) == (STATIC_COUNT + 4, MOVING_COUNT)  # and four walls
    assert all(body.path is not None for body in world.bodies)
