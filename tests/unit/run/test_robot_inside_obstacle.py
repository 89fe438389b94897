"""Test of robots inside solid obstacles."""

import pytest

from simscen.core.records.events import EventKind

SOLID_OBSTACLES = """\
simscen: 1
walls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}]
obstacles:
  - {name: crate, box: [1, 1, 1], pose: {x: 5, y: 4.5}}
  - {name: pillar, cylinder: [0.6, 2], pose: {x: 5, y: 2.5}}
  - {name: bend, polygon: [[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]], height: 1.5, pose: {x: 1, y: 2.5}}
"""


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("name", "x", "y"), [("crate", 5, 4.5), ("pillar", 5, 2.5), ("bend", 1.5, 3.0), ("bend", 1.5, 5.0)]
)
def test_a_robot_that_is_kidnapped_into_an_obstacle_collides_and_has_no_clearance(play, name, x, y):
    extra = f"events: [{{when: {{time: 1 s}}, do: {{kidnap: {{pose: {{x: {x}, y: {y}}}}}}}}}]\n"
    trace = play(extra, room=SOLID_OBSTACLES, time_limit="3")
    (hit,) = trace.of_kind(EventKind.COLLISION_STARTED)
    assert (hit.tick, hit.name) == (241, name)
    inside = trace.clearance.values[trace.clearance.ticks > 241]
    assert len(inside) > 50
    assert inside.max() < 0
