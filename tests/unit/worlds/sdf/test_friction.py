"""Tests of friction in SDF worlds (`<mu>`)."""

import math

import pytest

from simscen.worlds.geometry.drive_obstacles import drive_obstacles
from simscen.worlds.geometry.triangulation import merge_solids


def ramp(surface):
    shape = "<geometry><box><size>2 1.8 0.2</size></box></geometry>"
    collision = f"<collision name='c'><pose>0 0 -0.1 0 0 0</pose>{shape}{surface}</collision>"
    return f"<model name='ramp'><static>1</static><pose>3 1 0 0 -0.08 0</pose><link name='l'>{collision}</link></model>"


def mu(text):
    return f"<surface><friction><ode><mu>{text}</mu></ode></friction></surface>"


@pytest.mark.parametrize(("surface", "friction"), [("", 1.0), (mu(0.3), 0.3), (mu("100.0"), 1.0), (mu("inf"), 1.0)])
def test_friction_is_that_of_the_surface_but_at_most_that_of_rubber(load, surface, friction):
    (solid,) = load(ramp(surface)).solids
    assert solid.friction == friction
    assert merge_solids([solid]).frictions == (() if friction == 1.0 else (friction,))


@pytest.mark.parametrize("text", ["-1", "dry", ""])
def test_an_invalid_coefficient_of_friction_becomes_1_with_a_note(load, text):
    world = load(ramp(mu(text)))
    assert world.solids[0].friction == 1.0
    assert any("not a coefficient of friction" in note for note in world.notes)


def test_a_tilted_box_is_a_ramp_for_a_robot_that_climbs_it_and_a_wall_for_others(load):
    solids = load(ramp("")).solids
    climbed = drive_obstacles(solids, 0.033, math.radians(7.9), 0.0097)
    assert climbed is not solids
    assert all(solid.shape.size[1] == 0.01 for solid in climbed)  # only its sides are left
    assert drive_obstacles(solids, 0.033, 0.0, 0.0) is solids
