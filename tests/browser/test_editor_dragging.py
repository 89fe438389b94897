"""Tests of the map of the editor in a browser: mouse and keyboard move objects and change only their values."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from editor_page import TEXT, Edit, drag, pixel, settle, text


def test_dragging_the_robot_changes_its_coordinates_and_keeps_their_notation(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    drag(tab, (1, 2), (2.5, 1.5))
    assert text(tab) == TEXT.replace("x: 1.00 m, y: 2,", "x: 2.50 m, y: 1.5,")


def test_dragging_a_goal_and_an_obstacle(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    drag(tab, (7.5, 2.2), (7.0, 1.2))
    drag(tab, (4.5, 4), (5.5, 3.5))
    expected = TEXT.replace("{x: 7.5, y: 2.2}", "{x: 7.0, y: 1.2}").replace("{x: 4.5, y: 4}", "{x: 5.5, y: 3.5}")
    assert text(tab) == expected


def test_dragging_a_corner_of_a_region_a_door_a_person_and_their_path(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    drag(tab, (5, 2), (5.5, 2.5))
    drag(tab, (6.5, 0), (6.5, 0.5))
    drag(tab, (8, 4), (8.5, 3.5))
    drag(tab, (2, 4.5), (2.5, 4))
    content = text(tab)
    assert "[[3, 0.5], [5, 0.5], [5.5, 2.5], [3, 2]]" in content
    assert "points: [[6, 0.5], [7, 0.5]]" in content
    assert "pose: {x: 8.5, y: 3.5}, goals: [[6, 4.5], [2.5, 4.0]]" in content
    assert "# a comment that must survive" in content


EVERYTHING = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: long wall, points: [[0, 6], [9, 6]]}]
  objects: [{name: cart, box: [0.6, 0.6, 1], pose: {x: 2, y: 5}, move: {through: [[4, 5]], speed: 0.5 m/s}}]
  ramps: [{name: slope, start: [6, 5], end: [7, 5], width: 0.6, height: 0.05}]
  places: {dock: {x: 8, y: 5}}
robot: {pose: {x: 1, y: 1}, initial_estimate: {x: 1.5, y: 1.6, yaw: 0}}
goals: [{pose: {x: 3, y: 1}}]
events:
  - when: {time: 1 s}
    do:
      - {spawn: {name: box, cylinder: [0.3, 1], pose: {x: 4, y: 3}}}
      - {teleport: {name: cart, pose: {x: 5, y: 3}}}
      - {kidnap: {pose: {x: 6, y: 3}}}
      - {new_goal: {name: extra, pose: {x: 7, y: 3}}}
      - {friction: {at: [2, 3], radius: 0.5, value: 0.1}}
      - {move: {name: cart, keyframes: [[1, 3, 4, 0], [2, 4, 4, 0]]}}
pass: []
"""


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("start", "end", "before", "after"),
    [
        ((4.5, 6), (4.5, 5.6), "[[0, 6], [9, 6]]", "[[0, 5.6], [9, 5.6]]"),
        ((2, 5), (2.5, 4.6), "pose: {x: 2, y: 5}", "pose: {x: 2.5, y: 4.6}"),
        ((4, 5), (4.5, 4.6), "through: [[4, 5]]", "through: [[4.5, 4.6]]"),
        ((6.5, 5), (6.5, 4.6), "start: [6, 5], end: [7, 5]", "start: [6, 4.6], end: [7, 4.6]"),
        ((8, 5), (8.5, 4.6), "dock: {x: 8, y: 5}", "dock: {x: 8.5, y: 4.6}"),
        ((1, 1), (0.5, 0.8), "pose: {x: 1, y: 1}", "pose: {x: 0.5, y: 0.8}"),
        ((1.5, 1.6), (2, 2), "{x: 1.5, y: 1.6, yaw: 0}", "{x: 2.0, y: 2.0, yaw: 0}"),
        ((4, 3), (4.4, 2.6), "pose: {x: 4, y: 3}", "pose: {x: 4.4, y: 2.6}"),
        ((5, 3), (5.4, 2.6), "pose: {x: 5, y: 3}", "pose: {x: 5.4, y: 2.6}"),
        ((6, 3), (6.4, 2.6), "pose: {x: 6, y: 3}", "pose: {x: 6.4, y: 2.6}"),
        ((7, 3), (7.4, 2.6), "pose: {x: 7, y: 3}", "pose: {x: 7.4, y: 2.6}"),
        ((2, 3), (2.4, 2.6), "at: [2, 3]", "at: [2.4, 2.6]"),
        ((3, 4), (3.4, 3.6), "[1, 3, 4, 0]", "[1, 3.4, 3.6, 0]"),
    ],
    ids=(
        [
            "wall",
            "object",
            "path",
            "ramp",
            "place",
            "robot",
            "estimate",
            "spawned",
            "teleported",
            "kidnapped",
            "new-goal",
            "patch",
            "keyframe",
        ]
    ),
)
def test_all_kinds_of_objects_can_be_dragged(
    edit: Edit, tmp_path: Path, start: tuple[float, float], end: tuple[float, float], before: str, after: str
) -> None:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(EVERYTHING)
    tab = edit(file)
    drag(tab, start, end)
    assert text(tab) == EVERYTHING.replace(before, after, 1)


def test_dragging_a_trigger_and_its_radius(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    drag(tab, (6, 3), (5.5, 2.5))
    drag(tab, (7.0, 2.5), (6.5, 2.5))
    assert "robot_within: {of: [5.5, 2.5], distance: 1.0 m}" in text(tab)


def test_dragging_a_region_as_a_whole_moves_all_its_corners(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    drag(tab, (4, 1.2), (4.5, 1.7))
    assert "regions: {lane: [[3.5, 1.0], [5.5, 1.0], [5.5, 2.5], [3.5, 2.5]]}" in text(tab)


def test_turning_the_robot_writes_degrees(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    tab.page.evaluate("editor.select('robot')")
    settle(tab)
    knob = tab.page.evaluate("editor.view.turnKnob(editor.object)")
    drag(tab, tuple(knob), (1, 3))
    assert text(tab) == TEXT.replace("yaw: 0 deg", "yaw: 90 deg")


def test_arrow_keys_move_the_selected_object_and_undo_goes_back(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    tab.page.get_by_role("button", name="goal shelf").focus()
    tab.page.keyboard.press("Enter")
    for key in ("ArrowLeft", "ArrowLeft", "ArrowUp", "Control+ArrowUp"):
        tab.page.keyboard.press(key)
    tab.until("editor.history.before.length === 1 && !editor.keyMove")
    settle(tab)
    assert text(tab) == TEXT.replace("{x: 7.5, y: 2.2}", "{x: 7.3, y: 2.31}")
    tab.page.keyboard.press("Control+z")
    tab.until("editor.history.before.length === 0")
    settle(tab)
    assert text(tab) == TEXT
    tab.page.keyboard.press("Control+y")
    settle(tab)
    assert "{x: 7.3, y: 2.31}" in text(tab)


def test_the_shortest_path_and_the_clearance_follow_while_dragging(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    tab.page.evaluate("editor.select('goals/0')")
    settle(tab)
    assert "shortest path 6.50 m" in tab.page.inner_text("#facts")
    tab.page.mouse.move(*pixel(tab, 7.5, 2.2))
    tab.page.mouse.down()
    tab.page.mouse.move(*pixel(tab, 5, 2))
    tab.until("document.getElementById('facts').textContent.includes('4.00 m')")
    assert text(tab) == TEXT
    tab.page.keyboard.press("Escape")
    tab.page.mouse.up()
    settle(tab)
    assert text(tab) == TEXT


def test_fast_arrow_keys_add_up(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    tab.page.get_by_role("button", name="goal shelf").click()
    for count in range(12):
        tab.page.keyboard.press("ArrowLeft")
        tab.page.wait_for_timeout(count * 20)
    tab.page.get_by_role("button", name="rack at").click()
    tab.page.keyboard.press("ArrowLeft")
    tab.page.keyboard.press("Control+z")
    tab.page.keyboard.press("Control+y")
    tab.until("!editor.keyMove && editor.text.includes('x: 4.4')")
    settle(tab)
    assert text(tab) == TEXT.replace("{x: 7.5, y: 2.2}", "{x: 6.3, y: 2.2}").replace("x: 4.5, y: 4}", "x: 4.4, y: 4}")
