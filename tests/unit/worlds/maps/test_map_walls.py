import time

import numpy as np
import pytest
import trimesh

from simscen.core.environment.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose2
from simscen.worlds.geometry.cross_section import cross_section
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.map_walls import walls_from_map
from simscen.worlds.maps.occupancy_map import occupied_cells

TURNED = Pose2(3.0, -2.0, 0.7)


def speckled(seed, shape=(30, 40), share=0.3):
    cells = np.where(np.random.default_rng(seed).random(shape) < share, OCCUPIED, 0).astype(np.int8)
    cells[0, :3] = UNKNOWN
    return OccupancyGrid(cells, 0.05, TURNED)


@pytest.mark.parametrize("seed", range(5))
def test_walls_made_of_a_map_draw_that_map_again(seed):
    grid = speckled(seed)
    mesh = merge_solids(walls_from_map(grid, 1.0))
    again = occupied_cells(grid, cross_section(mesh, 0.5))
    assert np.array_equal(again, grid.cells == OCCUPIED)


def test_walls_enclose_just_the_occupied_cells_and_rise_to_their_height():
    grid = speckled(9)
    mesh = merge_solids(walls_from_map(grid, 1.5))
    volume = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume
    assert volume == pytest.approx((grid.cells == OCCUPIED).sum() * 0.05**2 * 1.5)
    assert mesh.vertices[:, 2].min() == 0.0
    assert mesh.vertices[:, 2].max() == 1.5


def test_a_long_wall_is_six_faces_however_many_cells_it_has():
    cells = np.zeros((100, 1000), np.int8)
    cells[20:24, 10:990] = OCCUPIED
    assert len(merge_solids(walls_from_map(OccupancyGrid(cells, 0.05), 1.0)).faces) == 12


def test_a_map_without_walls_makes_none():
    assert walls_from_map(OccupancyGrid(np.zeros((5, 5), np.int8), 0.05), 1.0) == []


def test_sixteen_million_cells_of_a_building_take_seconds_at_most():
    cells = np.zeros((4000, 4000), np.int8)
    cells[::100, :] = OCCUPIED
    cells[:, ::100] = OCCUPIED
    cells[50::100, 50::100] = 0
    begin = time.process_time()
    solids = walls_from_map(OccupancyGrid(cells, 0.05), 1.0)
    assert time.process_time() - begin < 10
    assert len(World("w", tuple(solids)).solids) == 1


def test_sixteen_million_cells_of_noise_are_refused_before_memory_runs_out():
    cells = np.zeros((4000, 4000), np.int8)
    cells[::2, ::2] = OCCUPIED
    with pytest.raises(InvalidInput, match="too ragged"):
        walls_from_map(OccupancyGrid(cells, 0.05), 1.0)
