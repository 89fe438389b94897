"""Tests of horizontal cross sections of meshes."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Capsule, Cone, Extrusion, Solid, Sphere
from simscen.worlds.geometry.cross_section import cross_section
from simscen.worlds.geometry.triangulation import merge_solids


def test_a_sphere_is_cut_into_a_circle_of_the_right_radius():
    segments = cross_section(merge_solids([Solid(Sphere(0.5), Pose3(1, 2, 0.5))]), 0.8).segments
    radii = np.hypot(*(segments.reshape(-1, 2) - (1, 2)).T)
    assert radii == pytest.approx(0.4, abs=0.001)


def test_sections_are_closed_loops_with_the_solid_on_the_left():
    polygon = ((0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2))
    solids = [
        Solid(Extrusion(polygon, 1.0), Pose3.from_rpy(4, 4, 0, 0, 0, 1.0)),
        Solid(Cone(1.0, 2.0), Pose3.from_rpy(-3, 0, 0.5, 0.7, 0.2, 0)),
        Solid(Capsule(0.3, 1.0), Pose3.from_rpy(0, -3, 0.4, 0, math.pi / 2, 0)),
    ]
    section = cross_section(merge_solids(solids), 0.4)
    for owner in range(3):
        segments = section.segments[section.owners == owner]
        starts = {tuple(p) for p in segments[:, 0].tolist()}
        assert starts == {tuple(p) for p in segments[:, 1].tolist()}
        (x0, y0), (x1, y1) = segments[:, 0].T, segments[:, 1].T
        assert np.sum(x0 * y1 - x1 * y0) > 0


def test_a_box_is_cut_from_above_its_underside_up_to_its_top():
    mesh = merge_solids([Solid(Box((1.0, 1.0, 1.0)), Pose3(z=1.0))])
    assert len(cross_section(mesh, 0.5).segments) == 0
    assert len(cross_section(mesh, 0.500001).segments) == 8
    assert len(cross_section(mesh, 1.5).segments) == 4
    assert len(cross_section(mesh, 1.500001).segments) == 0
