"""Tests of 29 minimal SDF files with one construct each."""

import math
from pathlib import Path

import numpy as np
import pytest

from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cone, Ellipsoid, Extrusion
from simscen.worlds.sdf import load_sdf

UNIT_BOX = Box((1.0, 1.0, 1.0))
ORIGIN = Pose3()
ROTATED = Pose3.from_rpy(0, 0, 0, 0, 0, math.pi / 2)

STATIC = {
    "actor": [(UNIT_BOX, ORIGIN)],
    "capsule": [(Capsule(0.2, 1.0), ORIGIN)],
    "cone": [(Cone(0.2, 1.0), ORIGIN)],
    "ellipsoid": [(Ellipsoid((0.2, 0.3, 0.4)), ORIGIN)],
    "frame": [(UNIT_BOX, Pose3(11, 2, 0))],
    "model_pose_link_pose": [(UNIT_BOX, ROTATED._replace(x=10, y=3))],
    "nested_model": [(UNIT_BOX, Pose3(6, 0, 0))],
    "one_link": [(UNIT_BOX, ORIGIN)],
    "polyline": [(Extrusion(((0, 0), (1, 0), (1, 1)), 1.0), ORIGIN)],
    "pose_deg": [(Box((4.0, 1.0, 1.0)), ROTATED)],
    "state_moves": [(UNIT_BOX, Pose3(7, 0, 0))],
    "static_true": [(UNIT_BOX, ORIGIN)],
    "toplevel_model": [(UNIT_BOX, ORIGIN)],
    "two_col": [(UNIT_BOX, ORIGIN), (UNIT_BOX, Pose3(3, 0, 0))],
    "two_links": [(UNIT_BOX, ORIGIN), (UNIT_BOX, Pose3(3, 0, 0))],
    "two_worlds": [(UNIT_BOX, ORIGIN)],
}
MOVING = {
    "no_static": [("m", 1.0, [ORIGIN])],
    "two_links_nostatic": [("m::a", 1.0, [ORIGIN]), ("m::b", 1.0, [Pose3(3, 0, 0)])],
    "two_models_joint": [("m", 2.0, [ORIGIN, Pose3(2, 0, 0)])],
}
EMPTY = ("nolink", "visual_only")
"""Files in which nothing is skipped, because an empty floor may be intended."""

REFUSED = {
    "gazebo_root": (1, "the root element is <gazebo>, expected <sdf>"),
    "heightmap": (126, "world[w]/model[h]/link[a]/collision[c]/geometry/heightmap/uri: file://h.png: no such file"),
    "include_only": (45, "world[w]/include/uri: model://foo: no such file"),
    "include_plus": (45, "world[w]/include/uri: model://foo: no such file"),
    "meshmiss": (121, "world[w]/model[h]/link[a]/collision[c]/geometry/mesh/uri: model://nope/x.dae: no such file"),
    "model_with_include": (79, "world[w]/model[m]/include/uri: model://foo: no such file"),
    "nolink": (20, "world[w]: no collision geometry in this world: its models have no links"),
    "population": (36, "world[w]/population[p]: <population> is not supported"),
    "pose_rel": (70, "world[w]/model[m]/pose: unknown frame 'q'"),
    "visual_only": (20, "world[w]: no collision geometry in this world: its links have no collisions"),
}


def load(data: Path, name: str, *, lenient: bool = False) -> World:
    folder = data / "sdf_minimal"
    return load_sdf(folder / f"{name}.sdf", root=folder, lenient=lenient)


def test_every_file_has_an_expectation(data: Path) -> None:
    assert {file.stem for file in (data / "sdf_minimal").glob("*.sdf")} == {*STATIC, *MOVING, *REFUSED}


@pytest.mark.parametrize("name", STATIC)
def test_static_models_become_solids_with_the_poses_of_gazebo(data: Path, name: str) -> None:
    world = load(data, name)
    assert [solid.shape for solid in world.solids] == [shape for shape, _ in STATIC[name]]
    poses = [pose for _, pose in STATIC[name]]
    np.testing.assert_allclose([solid.pose for solid in world.solids], poses, atol=1e-4)
    assert not world.bodies


@pytest.mark.parametrize("name", MOVING)
def test_other_models_become_bodies_with_their_mass(data: Path, name: str) -> None:
    world = load(data, name)
    assert not world.solids
    assert [(body.name, body.mass) for body in world.bodies] == [(n, mass) for n, mass, _ in MOVING[name]]
    for body, (_, _, poses) in zip(world.bodies, MOVING[name], strict=True):
        np.testing.assert_allclose([body.pose.compose(solid.pose) for solid in body.solids], poses, atol=1e-12)


@pytest.mark.parametrize("name", REFUSED)
def test_unsupported_geometry_is_an_error_with_its_position(data: Path, name: str) -> None:
    col, message = REFUSED[name]
    with pytest.raises(InvalidInput) as caught:
        load(data, name)
    (problem,) = caught.value.problems
    assert (problem.path, problem.line, problem.col) == (f"{name}.sdf", 1, col)
    assert message in problem.message


def test_lenient_loading_skips_unsupported_geometry_with_a_note(data: Path) -> None:
    world = load(data, "include_plus", lenient=True)
    assert len(world.solids) == 1
    assert any("include_plus.sdf: world[w]" in note and "skipped" in note for note in world.notes)


@pytest.mark.parametrize("name", [name for name in REFUSED if name not in ("gazebo_root", "include_plus", *EMPTY)])
def test_lenient_loading_that_skips_everything_is_an_error(data: Path, name: str) -> None:
    with pytest.raises(InvalidInput, match="nothing is left of this world"):
        load(data, name, lenient=True)


def test_ignored_parts_leave_a_note(data: Path) -> None:
    assert load(data, "actor").notes == (
        "actor.sdf: world[w]/actor[x]: an actor without skin and collision geometry is ignored",
    )
    assert load(data, "two_worlds").notes == (
        "two_worlds.sdf: world[w2]: only the first world of a file is loaded, which is 'w'",
    )
