"""Tests of third-party worlds against independent parsers and their maps."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from scipy.ndimage import distance_transform_edt

from simscen.core.environment.world_model import World
from simscen.core.geometry.shapes import Cylinder, Mesh
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.occupancy_map import draw_map
from simscen.worlds.raycasting.ray_scene import RayScene
from simscen.worlds.sdf import load_sdf

BARN = ("world_1", "world_40", "world_55", "world_111", "world_217", "world_289")


@pytest.mark.parametrize("name", BARN)
def test_barn_cylinders_have_the_poses_of_the_saved_state(data: Path, name: str) -> None:
    world = load_sdf(data / "barn_sample" / f"{name}.world", root=data)
    expected = _cylinders(data / "barn_sample" / f"{name}.world")
    assert len(world.solids) == len(expected) > 190
    for solid, (label, radius, length, x, y, z) in zip(world.solids, expected, strict=True):
        assert solid.name == label
        assert solid.shape == Cylinder(radius, length)
        assert math.dist(solid.pose.position, (x, y, z)) < 0.001
    assert not world.bodies
    assert not world.notes


def _cylinders(file: Path) -> list[tuple[str, float, float, float, float, float]]:
    """Return name, radius, length, and position, read with ElementTree; all rotations in these files are zero."""
    world = ET.parse(file).getroot()[0]
    saved = {model.get("name"): model.find("link") for model in world.findall("state/model")}
    found = []
    for model in world.findall("model"):
        shape = model.find("link/collision/geometry/cylinder")
        if shape is not None:
            name = model.get("name")
            numbers = [float(word) for word in saved[name].findtext("pose").split()]
            assert numbers[3:] == [0, 0, 0]
            radius, length = float(shape.findtext("radius", "")), float(shape.findtext("length", ""))
            found.append((f"{name}::link::collision", radius, length, *numbers[:3]))
    return found


@pytest.mark.parametrize("name", ["small_warehouse", "no_roof_small_warehouse"])
def test_every_include_of_the_warehouse_loads_its_mesh(data: Path, name: str) -> None:
    folder = data / "aws_small_warehouse"
    file = folder / "worlds" / f"{name}.world"
    world = load_sdf(file, root=folder, search=[folder / "models"])
    assert len(world.solids) == len(ET.parse(file).findall(".//include")) > 20
    assert all(isinstance(solid.shape, Mesh) for solid in world.solids)
    assert not world.bodies
    assert [note.partition("]: ")[2] for note in world.notes] == [
        "its floor is 0.034 m above z = 0; the world is lowered by that height"
    ]
    np.testing.assert_allclose(world.bounds, (-6.99, -10.45, 6.99, 10.45), atol=0.01)


def test_concave_walls_are_not_filled(data: Path) -> None:
    folder = data / "aws_small_warehouse"
    world = load_sdf(folder / "worlds/no_roof_small_warehouse.world", root=folder, search=[folder / "models"])
    walls = [solid for solid in world.solids if "Wall" in solid.name]
    scene = RayScene(merge_solids(walls))
    directions = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    distances = scene.cast(np.tile([[0.0, 0.0, 1.0]], (4, 1)), directions)
    # The coordinates of the inner faces in the DAE, in cm: 685.14, 686.14, 1032.08, 1032.08.
    np.testing.assert_allclose(distances, [6.8514, 6.8614, 10.3208, 10.3208], atol=0.001)


def test_warehouse_map_matches_the_warehouse_world(data: Path) -> None:
    """95 % of the occupied cells are within 15 cm of solids at lidar height, after a shift of the whole map."""
    folder = data / "aws_small_warehouse"
    world = load_sdf(folder / "worlds/no_roof_small_warehouse.world", root=folder, search=[folder / "models"])
    map_ = draw_map(world, merge_solids(world.solids), 0.2)
    occupied, _ = _read_map(folder / "maps/005/map_rotated.png")
    rows, columns = np.nonzero(occupied)
    shift = (0.1, 0.15)  # best of a search over whole cells and quarter turns
    points = np.column_stack([columns, rows]) * CELL_M + 0.025 + (-7, -10.5) + shift
    cells = map_.cell_of(points)
    distances = distance_transform_edt(map_.cells != 100) * CELL_M
    assert np.mean(distances[cells[:, 0], cells[:, 1]] < 0.15) >= 0.95


def test_unit_applies_and_up_axis_is_ignored_as_in_gazebo(data: Path) -> None:
    """The hexagon has a unit of inches and Y_UP, but is upright along z in Gazebo, up to 1.4 m high."""
    world = _sandbox(data)
    hexagon = next(solid for solid in world.solids if solid.name.endswith("left_hand"))
    assert isinstance(hexagon.shape, Mesh)
    heights = hexagon.shape.vertices[:, 2]
    assert (heights.min(), heights.max()) == pytest.approx((0.0, 100 * 0.0254 * 0.55), abs=0.01)


def test_rays_in_the_sandbox_agree_with_its_map(data: Path) -> None:
    """92 % of the ranges are within 15 cm of ray casts through the shipped map.

    The other rays graze a column, which is up to one cell thicker in the map.
    """
    occupied, free = _read_map(data / "nav2_tb3_sandbox" / "tb3_sandbox.pgm")
    rows, columns = np.nonzero(free & (distance_transform_edt(~occupied) * CELL_M > 0.2))
    chosen = np.random.default_rng(0).choice(len(rows), 60, replace=False)
    scene = RayScene(merge_solids(_sandbox(data).solids))
    angles = np.arange(90) * 2 * math.pi / 90
    directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(90)])
    agreeing = 0
    for row, column in zip(rows[chosen], columns[chosen], strict=True):
        origin = [(column + 0.5) * CELL_M - 10, (row + 0.5) * CELL_M - 10, 0.2]
        ranges = np.minimum(scene.cast(np.tile(origin, (90, 1)), directions), RANGE_M)
        mapped = np.minimum(_map_range(occupied, row, column, angles), RANGE_M)
        agreeing += int(np.sum(np.abs(ranges - mapped) <= 0.15))
    assert agreeing >= 0.92 * 60 * 90


CELL_M, RANGE_M = 0.05, 20.0


def _sandbox(data: Path) -> World:
    folder = data / "nav2_tb3_sandbox"
    return load_sdf(folder / "worlds/tb3_sandbox.sdf.xacro", root=folder, search=[folder / "models"])


def _read_map(file: Path) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    darkness = (255 - np.asarray(Image.open(file).convert("L"), dtype=float)[::-1]) / 255
    return darkness > 0.65, darkness < 0.196


def _map_range(
    occupied: npt.NDArray[np.bool_], row: int, column: int, angles: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Return the ranges to the first occupied cell by Bresenham steps, as in map_calc_range of AMCL."""
    slope = np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))
    steps = np.arange(int(RANGE_M / CELL_M))[:, None]
    columns = np.rint(column + steps * np.cos(angles) / slope).astype(int)
    rows = np.rint(row + steps * np.sin(angles) / slope).astype(int)
    inside = (columns >= 0) & (columns < occupied.shape[1]) & (rows >= 0) & (rows < occupied.shape[0])
    hit = np.zeros(rows.shape, bool)
    hit[inside] = occupied[rows[inside], columns[inside]]
    first, beam = hit.argmax(axis=0), np.arange(len(angles))
    ranges = np.hypot(columns[first, beam] - column, rows[first, beam] - row) * CELL_M
    return np.where(hit.any(axis=0), ranges, np.inf)


def test_published_world_with_only_a_floor_is_empty_with_a_note(data: Path) -> None:
    folder = data / "nav2_tb3_sandbox"
    world = load_sdf(folder / "worlds/tb3_empty_world.sdf.xacro", root=folder, lenient=True)
    assert not world.solids
    assert any("only a ground plane" in note for note in world.notes)
