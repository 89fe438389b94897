"""Tests that degenerate meshes and shapes are loaded or refused without warnings of NumPy or trimesh."""

import math
import struct
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.worlds.built_world import build_world_and_map, inspect_world
from simscen.worlds.geometry.drive_obstacles import drive_obstacles
from simscen.worlds.geometry.overlaps import first_solid_in_disc, first_solid_in_footprint
from simscen.worlds.maps.world_picture import draw_world
from simscen.worlds.raycasting.ray_scene import RayScene
from simscen.worlds.routes.shortest_paths import legs_between
from simscen.worlds.sdf import load_sdf
from simscen.worlds.sdf.mesh_files import UnusableMesh, read_parts

Triangle = list[list[float]]

TRIANGLES: dict[str, Triangle] = {
    "regular": [[0, 0, 0], [1, 0, 0], [0, 1, 1]],
    "point": [[0, 0, 0], [0, 0, 0], [0, 0, 0]],
    "line": [[0, 0, 0], [1, 0, 1], [2, 0, 2]],
    "upright_line": [[0, 0, 0], [0, 0, 1], [0, 0, 2]],
    "huge": [[3e38, 0, 0], [0, 3e38, 0], [-3e38, 0, 3e38]],
    "tiny": [[1e-40, 0, 0], [0, 1e-40, 0], [0, 0, 1e-42]],
    "infinite": [[math.inf, 0, 0], [0, 1, 0], [0, 0, 1]],
    "not_a_number": [[math.nan, 0, 0], [0, 1, 0], [0, 0, 1]],
}
SCALES = ("1 1 1", "-1 1 1", "1e-13 1e-13 1", "1 1 1e-14", "1e-300 1e-300 1e-300", "1e308 1e308 1e308")
TRANSFORMS = (
    "<rotate>0 0 0 90</rotate>",
    "<rotate>0 0 nan 90</rotate>",
    "<scale>0 0 0</scale>",
    "<scale>1e300 1e300 1e308</scale>",
    "<matrix>inf 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>",
    "<lookat>0 0 0 0 0 0 0 0 0</lookat>",
)
SHAPES = (
    "<box><size>1e-320 1 1</size></box>",
    "<box><size>1e4 1e4 1e4</size></box>",
    "<cylinder><radius>1e-300</radius><length>1</length></cylinder>",
    "<sphere><radius>1e-200</radius></sphere>",
    "<ellipsoid><radii>1e4 1e-4 1e-9</radii></ellipsoid>",
    "<plane><normal>1e200 0 1e200</normal><size>1 1</size></plane>",
    "<polyline><point>0 0</point><point>1 0</point><point>2 0</point><height>1</height></polyline>",
    "<polyline><point>0 0</point><point>1e300 0</point><point>0 1e300</point><height>1</height></polyline>",
)


@pytest.fixture(autouse=True)
def warnings_are_errors() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("default", DeprecationWarning)
        yield


def stl(triangle: Triangle) -> bytes:
    facet = struct.pack("<12f", 0, 0, 0, *np.ravel(triangle)) + bytes(2)
    return bytes(80) + struct.pack("<I", 3) + 3 * facet


def ascii_stl(triangle: Triangle) -> bytes:
    vertices = "".join(f"vertex {x} {y} {z}\n" for x, y, z in triangle)
    return f"solid s\nfacet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\nendsolid s\n".encode()


def obj(triangle: Triangle) -> bytes:
    return ("".join(f"v {x} {y} {z}\n" for x, y, z in triangle) + "f 1 2 3\nf 1 1 2\n").encode()


def dae(triangle: Triangle, transform: str = "", unit: str = "1") -> bytes:
    numbers = " ".join(str(number) for corner in triangle for number in corner)
    axes = "".join(f"<param name='{axis}' type='float'/>" for axis in "XYZ")
    return (
        "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>"
        f"<asset><unit meter='{unit}'/></asset><library_geometries><geometry id='g'><mesh>"
        f"<source id='p'><float_array id='a' count='9'>{numbers}</float_array><technique_common>"
        f"<accessor source='#a' count='3' stride='3'>{axes}</accessor></technique_common></source>"
        "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
        "<triangles count='1'><input semantic='VERTEX' source='#v' offset='0'/><p>0 1 2</p></triangles>"
        "</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id='s'>"
        f"<node id='n'>{transform}<instance_geometry url='#g'/></node></visual_scene></library_visual_scenes>"
        "<scene><instance_visual_scene url='#s'/></scene></COLLADA>"
    ).encode()


WRITERS = {"binary.stl": stl, "ascii.stl": ascii_stl, "mesh.obj": obj, "mesh.dae": dae}


def process_world(world: World) -> None:
    """Run all steps of a session that process a world before the physics."""
    built = build_world_and_map(world, 0.2)
    inspect_world(built)
    draw_world(built, 0.2)
    drive_obstacles(world.solids, 0.1, 0.3, 0.02)
    RayScene(built.mesh).cast(np.array([[-3.0, 0.1, 0.2]]), np.array([[1.0, 0.0, 0.0]]), 10.0)
    legs_between(built, [(Pose2(-1.0, -1.0), Goal("goal", Pose2(3.0, 3.0)))], 0.3)
    first_solid_in_disc(world.solids, (0.2, 0.2), 0.3, (0.0, 0.4))
    footprint = ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))
    first_solid_in_footprint(world.solids, footprint, Pose2(0.0, 0.0, 0.4), (0.0, 0.4))


def load_and_process(folder: Path, geometry: str, pose: str) -> None:
    file = folder / "degenerate.sdf"
    file.write_text(
        f"<sdf version='1.9'><world name='w'><model name='m'><static>1</static><pose>{pose}</pose><link name='a'>"
        f"<inertial auto='1'/><collision name='c'><geometry>{geometry}</geometry></collision></link></model>"
        "</world></sdf>"
    )
    try:
        process_world(load_sdf(file, root=folder))
    except InvalidInput as error:
        assert all(problem.message for problem in error.problems)


@pytest.mark.sample(4)
@pytest.mark.parametrize("pose", ["0 0 0 0 0 0", "1000.1 2000.3 0.1 0.3 0.2 0.3"])
@pytest.mark.parametrize("file_name", WRITERS)
@pytest.mark.parametrize("triangle", TRIANGLES)
def test_worlds_with_degenerate_meshes_cause_no_warnings(
    tmp_path: Path, triangle: str, file_name: str, pose: str
) -> None:
    (tmp_path / file_name).write_bytes(WRITERS[file_name](TRIANGLES[triangle]))
    for scale in SCALES:
        load_and_process(tmp_path, f"<mesh><uri>{file_name}</uri><scale>{scale}</scale></mesh>", pose)


@pytest.mark.parametrize("pose", ["0 0 0 0 0 0", "1000.1 2000.3 0.1 0.3 0.2 0.3"])
@pytest.mark.parametrize("shape", SHAPES)
def test_worlds_with_degenerate_shapes_cause_no_warnings(tmp_path: Path, shape: str, pose: str) -> None:
    load_and_process(tmp_path, shape, pose)


@pytest.mark.parametrize("transform", TRANSFORMS)
@pytest.mark.parametrize("triangle", ["regular", "huge"])
def test_degenerate_transformations_cause_no_warnings(triangle: str, transform: str) -> None:
    try:
        parts = read_parts(dae(TRIANGLES[triangle], transform), ".dae")
    except UnusableMesh as error:
        assert str(error) == "a vertex or a transformation is not a finite number"
    else:
        assert all(np.isfinite(part.vertices).all() for part in parts)


@pytest.mark.parametrize("unit", ["0", "1e-320", "9e3", "nan", "inf"])
def test_degenerate_units_cause_no_warnings(unit: str) -> None:
    try:
        parts = read_parts(dae(TRIANGLES["huge"], unit=unit), ".dae")
    except UnusableMesh as error:
        assert "a unit of" in str(error)
    else:
        assert all(np.isfinite(part.vertices).all() for part in parts)


@pytest.mark.parametrize("file_name", WRITERS)
@pytest.mark.parametrize("triangle", ["infinite", "not_a_number"])
def test_non_finite_coordinates_are_refused_or_read_as_finite_ones(triangle: str, file_name: str) -> None:
    try:
        parts = read_parts(WRITERS[file_name](TRIANGLES[triangle]), Path(file_name).suffix)
    except UnusableMesh as error:
        assert str(error)
    else:
        assert all(np.isfinite(part.vertices).all() for part in parts)


def test_quads_of_an_obj_file_become_two_triangles() -> None:
    (part,) = read_parts(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", ".obj")
    assert part.faces.tolist() == [[0, 1, 2], [2, 3, 0]]


def test_a_huge_saved_scale_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "scaled.world"
    file.write_text(
        "<sdf version='1.6'><world name='w'><model name='m'><static>1</static><link name='a'><collision name='c'>"
        "<geometry><box><size>1 1 1</size></box></geometry></collision></link></model>"
        "<state world_name='w'><model name='m'><scale>1e308 1 1</scale></model></state></world></sdf>"
    )
    with pytest.raises(InvalidInput, match="a scale must be at most 10000"):
        load_sdf(file, root=tmp_path)
