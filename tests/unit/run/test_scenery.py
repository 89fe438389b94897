"""Tests of the scenery in logs: obstacles, ground, floors, zones, and places."""

from pathlib import Path

import numpy as np
import pytest

from simscen.core.records.events import EventKind
from simscen.loading.scenario import load_scenario
from simscen.record.log_header import SCENERY_FILE, scenery_from_header
from simscen.record.log_reader import read_log
from simscen.run.log_header import world_scenery
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

ROOT = Path(__file__).parents[3]


def scenery(name):
    file = ROOT / f"scenarios/{name}.scenario.yaml"
    return world_scenery(prepare(load_scenario(file, ROOT)))


def test_a_door_is_drawn_from_its_hinge_to_its_post_when_closed():
    (door,) = [body for body in scenery("obstacles/door_closes").things if body.name == "door meeting room"]
    (panel,) = door.outlines
    assert door.closed is not None and door.opened is not None
    panel_when_closed = door.closed.apply(np.array(panel))
    assert (panel_when_closed[:, 0].min(), panel_when_closed[:, 0].max()) == pytest.approx((8.5, 9.5), abs=0.002)
    assert door.pose == pytest.approx(door.opened)
    assert (door.opened.x, door.opened.y) == (9.5, 4.1)


def test_scenery_contains_ramps_sills_and_wet_floors_with_heights(tmp_path):
    file = tmp_path / "dock.scenario.yaml"
    file.write_text("""\
simscen: 1
world:
  simscen: 1
  obstacles:
    - {name: sill, box: [0.1, 1, 0.01], pose: {x: 3, y: 2}}
    - {name: pillar, box: [0.5, 0.5, 2], pose: {x: 3, y: 4}}
  ramps: [{name: ramp, start: [4.8, 1], end: [3.3, 1], width: 2, height: 12 cm}]
  regions: {bay: [[0, 0], [1, 0], [1, 1]]}
  friction: {bay: 0.35}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 2, y: 1}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
""")
    found = world_scenery(prepare(load_scenario(file, tmp_path)))
    assert [(ground.name, ground.height, ground.uphill) for ground in found.ground] == [
        ("sill", 0.01, (0.0, 0.0)),
        ("ramp", 0.12, (-0.08, 0.0)),
    ]
    assert sorted(found.ground[1].outline) == [(3.3, 0.0), (3.3, 2.0), (4.8, 0.0), (4.8, 2.0)]
    assert [(floor.region, floor.friction) for floor in found.floors] == [("bay", 0.35)]


def test_scenery_contains_the_zones_of_the_stack():
    assert [(zone.filter, zone.region) for zone in scenery("zones/closed_passage").zones] == [("keepout", "passage")]
    assert [(z.region, z.speed_limit) for z in scenery("zones/quiet_ward").zones] == [("north_corridor", 0.25)]


def test_a_log_contains_scenery_map_and_friction_changes(tmp_path):
    file = tmp_path / "spilled.scenario.yaml"
    file.write_text("""\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]}], places: {dock: {x: 3, y: 1}}}
map: none
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 1.2, y: 1}}]
events:
  - {when: {time: 0.5 s}, do: {friction: {at: [2, 2], radius: 0.4 m, value: 0.1, for: 2 s}}}
time_limit: 1 s
pass: [{collisions: {max: 0}}]
""")
    prepared = prepare(load_scenario(file, tmp_path))
    simulate(prepared, log=tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    found = scenery_from_header(log.header)
    assert found == world_scenery(prepared)
    assert found.map is not None and np.array_equal(found.map.grid.cells, prepared.built.map.cells)
    assert found.places["dock"].x == 3
    (spilled,) = log.trace.of_kind(EventKind.FLOOR_CHANGED)
    assert (spilled.name, spilled.data["friction"], spilled.data["until"]) == ("patch", 0.1, 2.5)
    assert len(spilled.data["outline"]) == 32
    assert SCENERY_FILE in log.header.files
