"""Tests of `simscen world`: inspect, export, and convert."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED
from simscen.loading.files.single_files import load_world_file
from simscen.worlds.maps.ros_map import load_map

ROOM = """\
simscen: 1
walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
obstacles: [{name: crate, box: [1, 1, 1], pose: {x: 3, y: 2}}]
objects: [{name: cart, cylinder: [0.3, 1], mass: 5, pose: {x: 1, y: 1}}]
places: {dock: {x: 5, y: 3}}
regions: {bay: [[0, 0], [1, 0], [1, 1]]}
"""
SDF = """<sdf version='1.6'><world name='shop'><model name='m'><static>1</static><link name='l'>
<collision name='c'><geometry><sphere><radius>1</radius></sphere></geometry></collision></link></model>{more}
</world></sdf>"""


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """Return a folder with the world file of a room."""
    (tmp_path / "room.world.yaml").write_text(ROOM)
    return tmp_path


def test_inspect_prints_the_content(simscen, room: Path) -> None:
    result = simscen("world", "inspect", "room.world.yaml")
    assert result.code == 0
    assert "  bounds    x -0.05 … 6.05 m, y -0.05 … 4.05 m (6.10 x 4.10 m)\n" in result.out
    assert "  static    5 solids: 4 extrusion, 1 box\n  moving    1 object\n" in result.out
    assert "    crate   box            12 triangles  x 2.50 … 3.50  y 1.50 … 2.50  z 0.00 … 1.00\n" in result.out
    assert "z 0.00 … 1.00  5 kg\n" in result.out
    assert result.out.endswith("  places    dock\n  regions   bay\n")


def test_inspect_draws_cross_section_and_map(simscen, room: Path) -> None:
    assert simscen("world", "inspect", "room.world.yaml", "--png", "new/room.png").code == 0
    with Image.open(room / "new/room.png") as picture:
        assert max(picture.size) == 1200
        assert len(picture.getcolors(1 << 20)) > 3


def test_json_is_printed(simscen, room: Path) -> None:
    output = json.loads(simscen("world", "inspect", "room.world.yaml", "--json").out)
    assert [body["name"] for body in output["bodies"]] == ["cart"]
    assert output["map_resolution"] == 0.05


def test_long_lists_are_cut_without_all(simscen, room: Path) -> None:
    posts = ", ".join(f"{{name: post, box: [0.1, 0.1, 1], pose: {{x: {x}, y: 0}}}}" for x in range(30))
    (room / "many.world.yaml").write_text(f"simscen: 1\nobstacles: [{posts}]\n")
    assert "… and 10 more (--all lists them)" in simscen("world", "inspect", "many.world.yaml").out
    assert simscen("world", "inspect", "many.world.yaml", "--all").out.count("post") == 30


def test_unsupported_sdf_is_an_error_or_with_lenient_a_warning(simscen, room: Path) -> None:
    (room / "shop.sdf").write_text(SDF.format(more="<include><uri>model://nowhere</uri></include>"))
    strict = simscen("world", "inspect", "shop.sdf")
    assert strict.code == 2
    assert "shop.sdf:2:113: error[SC310]" in strict.err
    lenient = simscen("world", "inspect", "shop.sdf", "--lenient")
    assert lenient.code == 0
    assert "shop.sdf: warning[SC311] world[shop]/include/uri: skipped: model://nowhere" in lenient.out


def test_exported_map_equals_the_map_of_a_lidar(simscen, room: Path) -> None:
    result = simscen("world", "export", "room.world.yaml", "--map", "maps/room.yaml")
    assert (result.code, result.out) == (0, "maps/room.yaml: 162 x 122 cells of 0.05 m\n")
    loaded = load_world_file(room / "maps/room.yaml", room).map
    assert loaded is not None
    grid, _ = load_map(loaded.spec, loaded.image)
    points = np.array([[3.0, 2.0], [5.0, 1.0], [6.0, 2.0], [1.0, 1.0]])
    assert grid.values_at(points).tolist() == [OCCUPIED, FREE, OCCUPIED, FREE]


def test_changes_of_a_converted_world_are_printed(simscen, room: Path) -> None:
    (room / "shop.sdf").write_text(SDF.format(more=""))
    result = simscen("world", "convert", "shop.sdf", "shop.world.yaml")
    assert (result.code, result.out) == (
        0,
        "changed: m::l::c: a sphere; replaced by an upright prism over its cross section at 0.2 m\n"
        "shop.world.yaml: 1 walls, obstacles, objects, and doors; 1 changed\n",
    )
    assert simscen("validate", "shop.world.yaml").code == 0


def test_world_file_is_converted_without_changes(simscen, room: Path) -> None:
    assert simscen("world", "convert", "room.world.yaml", "sub/copy.world.yaml").code == 0
    original, converted = (
        load_world_file(room / name, room).spec for name in ("room.world.yaml", "sub/copy.world.yaml")
    )
    assert converted == original


def test_ros_map_stays_a_separate_file(simscen, room: Path) -> None:
    simscen("world", "export", "room.world.yaml", "--map", "maps/room.yaml")
    assert simscen("world", "convert", "maps/room.yaml", "worlds/from_map.world.yaml").code == 0
    converted = load_world_file(room / "worlds/from_map.world.yaml", room)
    assert converted.map is not None
    assert converted.map.path == room / "maps/room.yaml"


def test_world_too_large_for_a_file_is_an_error(simscen, room: Path) -> None:
    box = "<collision name='c{}'><geometry><box><size>1 1 1</size></box></geometry></collision>"
    boxes = "".join(box.format(number) for number in range(10_001))
    model = f"<model name='x'><static>1</static><pose>0 0 1 0 0 0</pose><link name='l'>{boxes}</link></model>"
    (room / "big.sdf").write_text(SDF.format(more=model))
    result = simscen("world", "convert", "big.sdf", "big.world.yaml")
    assert result.code == 2
    assert (
        "big.sdf: error[SC312] the world cannot be written as a world file: obstacles: List should have at most"
        in result.err
    )
    assert not (room / "big.world.yaml").exists()


def test_object_named_like_a_model_cannot_be_converted(simscen, room: Path) -> None:
    box = "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>"
    (room / "cart.sdf").write_text(SDF.format(more=f"<model name='cart'><link name='l'>{box}</link></model>"))
    objects = "objects: [{name: cart, box: [1, 1, 1], pose: {x: 3, y: 3}}]"
    (room / "cart.world.yaml").write_text(f"simscen: 1\nsdf: cart.sdf\n{objects}\n")
    result = simscen("world", "convert", "cart.world.yaml", "copy.world.yaml")
    assert result.code == 2
    assert "as a world file: several objects have the name `cart`" in result.err


@pytest.mark.parametrize(
    ("arguments", "expected_text"),
    [
        (("inspect", "nowhere.world.yaml"), "no such file or directory"),
        (("inspect", "."), "not a regular file"),
        (("inspect", "room.world.yaml", "--png", "room.world.yaml/x.png"), "cannot write room.world.yaml/x.png"),
        (("export", "room.world.yaml", "--map", "room.world.yaml/x.yaml"), "cannot write room.world.yaml/x.pgm"),
        (("convert", "room.world.yaml", "room.world.yaml/x"), "cannot write room.world.yaml/x"),
    ],
)
def test_impossible_conversions_are_errors(simscen, room: Path, arguments, expected_text) -> None:
    result = simscen("world", *arguments)
    assert result.code == 2
    assert expected_text in result.err


@pytest.mark.parametrize(
    "arguments",
    [
        ("inspect", "hall.yaml", "--png", "plan.pgm"),
        ("inspect", "site.world.yaml", "--png", "plan.pgm"),
        ("export", "site.world.yaml", "--map", "hall.yaml"),
        ("export", "site.world.yaml", "--map", "plan.yaml"),
        ("convert", "site.world.yaml", "hall.yaml"),
    ],
)
def test_map_of_a_world_is_not_overwritten(simscen, room: Path, arguments) -> None:
    assert simscen("world", "export", "room.world.yaml", "--map", "plan.yaml").code == 0
    (room / "plan.yaml").rename(room / "hall.yaml")
    (room / "site.world.yaml").write_text("simscen: 1\nmap: hall.yaml\n")
    originals = {file.name: file.read_bytes() for file in room.iterdir()}
    assert simscen("world", *arguments).code == 2
    assert {file.name: file.read_bytes() for file in room.iterdir()} == originals


@pytest.mark.parametrize(
    ("arguments", "alternative"),
    [
        (("inspect", "vast.world"), "in scenarios, use `map: none`"),
        (("export", "vast.world", "--map", "vast.yaml"), "choose larger cells with --resolution"),
    ],
)
def test_a_map_that_would_be_too_large_is_an_error_of_the_file(simscen, room: Path, arguments, alternative) -> None:
    (room / "vast.world").write_text(SDF.format(more="").replace("<radius>1<", "<radius>300<"))
    result = simscen("world", *arguments)
    assert result.code == 2
    assert result.err.startswith("vast.world: error[SC330] map too large: 12")
    assert " ".join(result.err.split()).endswith(
        f'"m" makes the map large; move or remove this model, or {alternative}'
    )


def test_a_world_with_a_large_map_is_exported_with_larger_cells(simscen, room: Path) -> None:
    (room / "vast.world").write_text(SDF.format(more="").replace("<radius>1<", "<radius>300<"))
    result = simscen("world", "export", "vast.world", "--map", "vast.yaml", "--resolution", "0.5")
    assert result.code == 0
    assert "of 0.5 m" in result.out
