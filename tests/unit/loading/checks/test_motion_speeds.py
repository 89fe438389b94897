"""Scripted motions must be slow enough for contact with the robot to be found."""

import pytest

from simscen.loading.checks.scene_runner import check_in_world
from simscen.loading.scenario import load_scenario

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}}]
  doors: [{{name: door, points: [[4, 2], [4, 4]], closed: true}}]
  objects:
    - {{name: arm, box: [1, 0.05, 1], pose: {{x: 6, y: 1}}{world}}}
robot: {{pose: {{x: 2, y: 1}}}}
physics: {{tick_rate: {rate}}}
goals: [{{pose: {{x: 3, y: 1}}}}]
events:
  - {{when: {{time: 1 s}}, do: {{spawn: {{name: box, box: [0.2, 0.2, 1], pose: {{x: 7, y: 1}}}}}}}}
  - {{when: {{time: 2 s}}, do: {{{event}}}}}
pass: [{{goals_reached: {{}}}}]
"""
TURN = "keyframes: [[0, 6, 2, 0], [{}, 6, 2, 90 deg]]"


def speed_problems(tmp_path, world="", event="cancel_goal: {}", rate=240):
    file = tmp_path / "a.scenario.yaml"
    file.write_text(SCENARIO.format(world=world, event=event, rate=rate))
    return [(p.line, p.hint) for p in check_in_world(load_scenario(file, tmp_path)) if p.code == "SC305"]


@pytest.mark.parametrize(
    ("name", "seconds"), [("arm", 0.004), ("arm", 0.02), ("door", 0.004), ("door", 0.04), ("box", 0.004)]
)
def test_a_turn_within_few_ticks_is_an_error(tmp_path, name, seconds):
    event = f"move: {{name: {name}, {TURN.format(seconds)}}}"
    if name == "door":
        event = f"open: {{name: door, duration: {seconds}}}"
    (found,) = speed_problems(tmp_path, event=event)
    assert found[0] == 13
    assert found[1].startswith("make it ")
    assert not speed_problems(tmp_path, event=event.replace(str(seconds), "1.5"))


def test_motions_of_the_world_file_are_checked_at_its_line(tmp_path):
    assert [line for line, _ in speed_problems(tmp_path, world=f", move: {{{TURN.format(0.004)}}}")] == [7]


def test_speed_limit_of_scripted_objects_is_a_distance_per_tick(tmp_path):
    event = "move: {name: arm, through: [[6, 4]], speed: 20}"
    assert not speed_problems(tmp_path, event=event)
    assert speed_problems(tmp_path, event=event, rate=120) == [
        (13, "make it 1.7 times slower, or raise `physics.tick_rate`")
    ]
