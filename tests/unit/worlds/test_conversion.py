"""Tests of the conversion of worlds to YAML."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist
from shapely import Polygon, union_all

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.motion_paths import pose_at
from simscen.core.geometry.shapes import Body, Box, Capsule, Cone, Cylinder, Extrusion, Mesh, MotionPath, Solid, Sphere
from simscen.model.world import WorldSpec
from simscen.spec.motions import path_through_waypoints
from simscen.worlds.conversion import convert_world
from simscen.worlds.geometry.cross_section import cross_section
from simscen.worlds.geometry.section_polygons import rings_from_segments
from simscen.worlds.geometry.triangulation import merge_solids, triangulate
from simscen.worlds.world_file import world_from_spec

EMPTY = WorldSpec(simscen=1)
NEAR = st.floats(-20, 20)


def convert(*solids, bodies=(), height=0.2):
    """Convert a world to YAML and load it again; return the loaded world and the list of changes."""
    conversion = convert_world(World("w", solids, bodies), height)
    return world_from_spec(conversion.merged_into(EMPTY), "w"), conversion.changes


def assert_same_corners(solids, others, tolerance=1e-5):
    """Assert that the vertices correspond one to one, within the tolerance in m along each axis."""
    distances = cdist(merge_solids(solids).vertices, merge_solids(others).vertices, "chebyshev")
    assert distances.shape[0] == distances.shape[1]
    assert distances[linear_sum_assignment(distances)].max() <= tolerance


def section_of(solids, height):
    """Return the union of the cross sections of the solids at a height in m."""
    rings = [
        Polygon(ring)
        for solid in solids
        for ring in rings_from_segments(cross_section(merge_solids([solid]), height).segments)
    ]
    return union_all(rings)


@settings(max_examples=40, deadline=None)
@given(st.tuples(*[st.floats(0.05, 3)] * 3), NEAR, NEAR, st.sampled_from(range(6)), st.floats(-math.pi, math.pi))
def test_box_on_any_of_its_sides_is_converted_exactly(size, x, y, side, yaw):
    roll, pitch = [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (0, 3)][side]
    rotated = Pose3.from_rpy(0, 0, 0, roll * math.pi / 2, pitch * math.pi / 2, yaw)
    bottom = merge_solids([Solid(Box(size), rotated)]).vertices[:, 2].min()
    solid = Solid(Box(size), rotated._replace(x=x, y=y, z=0.01 - float(bottom)), "crate")
    world, changes = convert(solid)
    assert changes == []
    assert isinstance(world.solids[0].shape, Box)
    assert_same_corners(world.solids, [solid], 1e-4)


def test_cylinders_and_prisms_are_converted_exactly():
    solids = (
        Solid(Cylinder(0.3, 1.2), Pose3(1.0, 2.0, 0.6), "pillar"),
        Solid(Extrusion(((0, 0), (2, 0), (0, 1)), 0.8), Pose3.planar(Pose2(3, 1, 0.7), 0.5), "wedge"),
    )
    world, changes = convert(*solids)
    assert changes == []
    assert_same_corners(world.solids, solids)
    assert [solid.name for solid in world.solids] == ["pillar", "wedge"]


def test_geometry_below_the_ground_is_cut_off():
    world, changes = convert(
        Solid(Box((1, 1, 1)), Pose3(z=0.25), "sunk"), Solid(Box((9, 9, 1)), Pose3(z=-0.5), "floor")
    )
    assert changes == ["floor: it is below the ground; it is left out"]
    vertices = merge_solids(world.solids).vertices
    assert (vertices[:, 2].min(), vertices[:, 2].max()) == (0.0, 0.75)


@pytest.mark.parametrize(
    ("shape", "pose", "kind"),
    [
        (Sphere(0.5), Pose3(z=0.4), "a sphere"),
        (Cone(0.5, 1.0), Pose3(z=0.5), "a cone"),
        (Capsule(0.3, 1.0), Pose3(z=0.5), "a capsule"),
        (Box((1.0, 0.4, 0.6)), Pose3.from_rpy(1.0, 0.0, 0.3, 0.4, 0.1, 0.9), "a box"),
        (Cylinder(0.2, 2.0), Pose3.from_rpy(0, 0, 0.2, math.pi / 2, 0, 0.3), "a cylinder"),
    ],
)
def test_tilted_or_round_solids_become_prisms_with_a_note(shape, pose, kind):
    solid = Solid(shape, pose, "thing")
    world, changes = convert(solid, height=0.25)
    assert changes == [f"thing: {kind}; replaced by an upright prism over its cross section at 0.25 m"]
    before, after = section_of([solid], 0.25), section_of(world.solids, 0.25)
    assert before.symmetric_difference(after).area < 1e-4


def test_mesh_of_upright_walls_is_converted_exactly():
    ring = triangulate(Extrusion(((0, 0), (5, 0), (5, 4), (3, 4), (3, 1), (0, 1)), 2.0))
    solid = Solid(Mesh(ring.vertices, ring.faces), Pose3.planar(Pose2(1, 2, 0.3)), "wall")
    world, changes = convert(solid)
    assert changes == []
    assert_same_corners(world.solids, [solid])


def test_open_mesh_is_left_out_with_a_note():
    box = triangulate(Box((1, 1, 1)))
    solid = Solid(Mesh(box.vertices, box.faces[2:][:-1]), Pose3(z=0.5), "torn")
    world, changes = convert(solid)
    assert world.solids == ()
    assert changes == ["torn: a mesh whose cross section at 0.2 m is not closed; it is left out"]


def test_parts_of_a_solid_get_names_of_their_own():
    shelf = merge_solids([Solid(Box((0.2, 0.2, 1.0)), Pose3(x=x, z=0.5)) for x in (0.0, 2.0, 4.0)])
    solids = [Solid(Mesh(shelf.vertices, shelf.faces), Pose3(y=y), "s" * 130) for y in (0.0, 3.0)]
    conversion = convert_world(World("w", tuple(solids), ()), 0.2)
    names = [obstacle.name for obstacle in conversion.obstacles]
    assert names == ["s" * 120, *("s" * 118 + f"-{number}" for number in range(2, 7))]


def test_bodies_keep_mass_and_motion():
    start = Pose2(1.0, 1.0, 0.0)
    path = path_through_waypoints(start, [[4.0, 1.0], [4.0, 3.0]], 0.8, "back_and_forth")
    box = (Solid(Box((0.6, 0.4, 1.0)), Pose3(z=0.5)),)
    bodies = (Body("cart", box, Pose3.planar(start), 0.0, path), Body("bin", box, Pose3(x=3.0), 4.0))
    world, changes = convert(bodies=bodies)
    assert changes == []
    cart, bin_ = world.bodies
    assert bin_.mass == 4.0
    assert cart.path is not None
    assert cart.path.mode == "back_and_forth"
    np.testing.assert_allclose(cart.path.times, path.times)
    np.testing.assert_allclose(cart.path.poses, path.poses, atol=1e-9)


def test_unsupported_motions_and_shapes_are_reported():
    disc = (Solid(Cylinder(0.3, 1.0), Pose3(z=0.5)),)
    poses = (Pose2(0, 0), Pose2(1, 0), Pose2(2, 0))
    offset_disc = (Solid(Cylinder(0.3, 1.0), Pose3(x=1.0, z=0.5)),)
    moving = Body("beside", offset_disc, Pose3(), 0.0, MotionPath((0.0, 1.0, 9.0), poses))
    table = Body("table", (*disc, Solid(Box((1, 1, 0.1)), Pose3(z=1.0))), Pose3(x=5.0), 3.0)
    world, changes = convert(bodies=(moving, table))
    assert changes == [
        "beside: it moves, but its shape is not at its origin; it is made static",
        "table: it could be pushed and has 2 shapes, but an object has only one shape; it is made static",
    ]
    assert world.bodies[0].path is None
    assert [solid.name for solid in world.solids] == ["table", "table-2"]


def test_loop_that_does_not_end_at_its_start_is_reported_with_the_reason():
    path = MotionPath((0.0, 1.0, 3.0), (Pose2(0, 0), Pose2(0, 0), Pose2(1, 0)), "loop")
    body = Body("cart", (Solid(Cylinder(0.3, 1.0), Pose3(z=0.5)),), Pose3(), 0.0, path)
    world, [change] = convert(bodies=(body,))
    assert change.startswith("cart: its motion cannot be written as keyframes: the last keyframe of a loop must ")
    assert world.bodies[0].path is None


@pytest.mark.parametrize("mode", ["once", "back_and_forth"])
def test_motion_with_changing_speed_becomes_keyframes(mode):
    disc = (Solid(Cylinder(0.3, 1.0), Pose3(z=0.5)),)
    poses = (Pose2(0, 0), Pose2(1, 0), Pose2(2, 0.5, 1.0))
    path = MotionPath((0.0, 1.0, 9.0), poses, mode, ease="spline", phase=0.5)
    world, changes = convert(bodies=(Body("moving", disc, Pose3.planar(pose_at(path, 0.0)), 0.0, path),))
    assert changes == []
    assert world.bodies[0].path == path


def test_additions_of_the_file_come_last():
    spec = WorldSpec.model_validate(
        {"simscen": 1, "sdf": "x.sdf", "obstacles": [{"name": "mine", "box": [1, 1, 1], "pose": {"x": 0, "y": 0}}]}
    )
    conversion = convert_world(World("w", (Solid(Box((1, 1, 1)), Pose3(z=0.5), "theirs"),)), 0.2).merged_into(spec)
    assert conversion.sdf is None
    assert [obstacle.name for obstacle in conversion.obstacles] == ["theirs", "mine"]


def test_friction_of_a_plate_is_kept():
    world, changes = convert(Solid(Box((1.0, 1.0, 0.02)), Pose3(z=0.01), "plate", 0.3))
    assert (world.solids[0].friction, changes) == (0.3, [])


TINY = 4e-7
"""Length in m that is 0 when it is rounded to the micrometer."""
LINE = ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0))


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        (Box((TINY, 1.0, 1.0)), "its `box` is not valid: input should be greater than 0"),
        (Cylinder(TINY, 1.0), "its `cylinder` is not valid: input should be greater than 0"),
        (Extrusion(LINE, 1.0), "its `polygon` is not valid: the polygon encloses no area"),
        (Box((20_000.0, 1.0, 1.0)), "its `box` is not valid: input should be less than or equal to 10000"),
    ],
)
def test_unsupported_shape_is_omitted_with_a_reason(shape, reason):
    pose = Pose3(z=0.5) if not isinstance(shape, Extrusion) else Pose3()
    solids = (Solid(shape, pose, "plate"), Solid(Box((1, 1, 1)), Pose3(x=5.0, z=0.5), "crate"))
    bodies = (
        Body("thin", (Solid(shape, pose),), Pose3(x=3.0), 2.0),
        Body("both", (Solid(shape, pose), Solid(Box((1, 1, 1)), Pose3(z=0.5))), Pose3(x=8.0), 2.0),
    )
    world, changes = convert(*solids, bodies=bodies)
    assert changes == [f"{name}: {reason}; it is left out" for name in ("plate", "thin", "both")]
    assert [solid.name for solid in world.solids] == ["crate"]
    assert [(body.name, body.mass) for body in world.bodies] == [("both", 2.0)]


def test_mass_outside_the_range_of_world_files_is_reported():
    world, changes = convert(bodies=(Body("heavy", (Solid(Box((1, 1, 1)), Pose3(z=0.5)),), Pose3(), 1e6),))
    assert changes == ["heavy: its `mass` is not valid: input should be less than or equal to 100000; it is left out"]
    assert world.bodies == ()
