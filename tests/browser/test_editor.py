"""The editor in a browser: mouse and keyboard change the map, and only the values in the file that they are about."""

import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from rig import Opened, Opener

from simscen.cli.session.backends import backend_of
from simscen.editor.document import EditedFile
from simscen.editor.server import EditorServer
from simscen.editor.session import EditorSession
from simscen.run.sessions.run_session import SessionOptions

ROOT = Path(__file__).parents[2]
TEXT = """\
simscen: 1   # the version
name: hall
# a comment that must survive
world:
  simscen: 1
  walls: [{name: outer wall, points: [[0, 0], [9, 0], [9, 5], [0, 5], [0, 0]]}]
  obstacles:
    - {name: rack, box: [1.5, 0.6, 1], pose: {x: 4.5, y: 4}}   # heavy
  doors:
    - {name: gate, points: [[6, 0], [7, 0]]}
  places: {dock: {x: 1, y: 4.0}}
  regions: {lane: [[3, 0.5], [5, 0.5], [5, 2], [3, 2]]}
robot: {pose: {x: 1.00 m, y: 2, yaw: 0 deg}}
goals:
  - name: shelf
    pose: {x: 7.5, y: 2.2}
events:
  - name: anna walks
    when: {robot_within: {of: [6, 3], distance: 1.5 m}}
    do: {pedestrian: {name: anna, pose: {x: 8, y: 4}, goals: [[6, 4.5], [2, 4.5]]}}

pass:
  - goals_reached: {}
"""
Edit = Callable[..., Opened]


@pytest.fixture
def edit(open_page: Opener, tmp_path: Path) -> Iterator[Edit]:
    """Opens a file in the editor."""
    servers: list[EditorServer] = []

    def open_(file: Path, kind: str = "scenario", root: Path | None = None, **given: Any) -> Opened:
        session = EditorSession(EditedFile(file, kind, root or file.parent), lambda: backend_of(SessionOptions()))
        server = EditorServer(session)
        servers.append(server)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        opened = open_page(server.url, **given)
        opened.until("document.documentElement.dataset.ready !== undefined")
        settle(opened)
        return opened

    yield open_
    for server in servers:
        server.shutdown()
        server.server_close()
        server.close_files()


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    file = tmp_path / "hall.scenario.yaml"
    file.write_text(TEXT)
    return file


def settle(opened: Opened) -> None:
    """Wait until the page has nothing to do any more."""
    opened.until(
        "!editor.keyMove && !editor.previewing && document.documentElement.dataset.checked === "
        "String(editor.history.before.length)"
    )


def pixel(opened: Opened, x: float, y: float) -> tuple[float, float]:
    """The position of a point of the world on the screen."""
    script = (
        "([x, y]) => { const b = editor.view.canvas.getBoundingClientRect(); const [u, v] = editor.view.pixel(x, y);"
    )
    u, v = opened.page.evaluate(script + " return [b.left + u, b.top + v]; }", [x, y])
    return u, v


def drag(opened: Opened, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag with the mouse between two points of the world."""
    before = opened.page.evaluate("editor.history.before.length")
    mouse = opened.page.mouse
    mouse.move(*pixel(opened, *start))
    mouse.down()
    mouse.move(*pixel(opened, *((a + b) / 2 for a, b in zip(start, end, strict=True))))
    mouse.move(*pixel(opened, *end))
    mouse.up()
    opened.until(f"editor.history.before.length > {before}")
    settle(opened)


def text(opened: Opened) -> str:
    shown = opened.page.input_value("#text")
    assert shown == opened.page.evaluate("editor.text")
    return str(shown)


def changes(before: str, after: str) -> list[tuple[str, str]]:
    """The pieces of the text that differ, by whole words."""
    words = [re.findall(r"[\w.-]+|\W", one) for one in (before, after)]
    steps = SequenceMatcher(None, *words, autojunk=False).get_opcodes()
    return [("".join(words[0][a:b]), "".join(words[1][c:d])) for what, a, b, c, d in steps if what != "equal"]


def test_dragging_the_robot_changes_its_two_numbers_and_keeps_their_notation(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    drag(opened, (1, 2), (2.5, 1.5))
    assert text(opened) == TEXT.replace("x: 1.00 m, y: 2,", "x: 2.50 m, y: 1.5,")


def test_dragging_a_goal_and_an_obstacle(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    drag(opened, (7.5, 2.2), (7.0, 1.2))
    drag(opened, (4.5, 4), (5.5, 3.5))
    wanted = TEXT.replace("{x: 7.5, y: 2.2}", "{x: 7.0, y: 1.2}").replace("{x: 4.5, y: 4}", "{x: 5.5, y: 3.5}")
    assert text(opened) == wanted


def test_dragging_a_corner_of_a_region_a_door_a_person_and_their_path(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    drag(opened, (5, 2), (5.5, 2.5))
    drag(opened, (6.5, 0), (6.5, 0.5))
    drag(opened, (8, 4), (8.5, 3.5))
    drag(opened, (2, 4.5), (2.5, 4))
    shown = text(opened)
    assert "[[3, 0.5], [5, 0.5], [5.5, 2.5], [3, 2]]" in shown
    assert "points: [[6, 0.5], [7, 0.5]]" in shown
    assert "pose: {x: 8.5, y: 3.5}, goals: [[6, 4.5], [2.5, 4.0]]" in shown
    assert "# a comment that must survive" in shown


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
def test_everything_that_has_a_place_can_be_dragged(
    edit: Edit, tmp_path: Path, start: tuple[float, float], end: tuple[float, float], before: str, after: str
) -> None:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(EVERYTHING)
    opened = edit(file)
    drag(opened, start, end)
    assert text(opened) == EVERYTHING.replace(before, after, 1)


def test_dragging_a_trigger_and_its_radius(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    drag(opened, (6, 3), (5.5, 2.5))
    drag(opened, (7.0, 2.5), (6.5, 2.5))
    assert "robot_within: {of: [5.5, 2.5], distance: 1.0 m}" in text(opened)


def test_dragging_a_region_as_a_whole_moves_all_its_corners(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    drag(opened, (4, 1.2), (4.5, 1.7))
    assert "regions: {lane: [[3.5, 1.0], [5.5, 1.0], [5.5, 2.5], [3.5, 2.5]]}" in text(opened)


def test_turning_the_robot_writes_degrees(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    opened.page.evaluate("editor.select('robot')")
    settle(opened)
    knob = opened.page.evaluate("editor.view.turnKnob(editor.object)")
    drag(opened, tuple(knob), (1, 3))
    assert text(opened) == TEXT.replace("yaw: 0 deg", "yaw: 90 deg")


def test_arrow_keys_move_the_selected_object_and_undo_goes_back(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    opened.page.get_by_role("button", name="goal shelf").focus()
    opened.page.keyboard.press("Enter")
    for key in ("ArrowLeft", "ArrowLeft", "ArrowUp", "Control+ArrowUp"):
        opened.page.keyboard.press(key)
    opened.until("editor.history.before.length === 1 && !editor.keyMove")
    settle(opened)
    assert text(opened) == TEXT.replace("{x: 7.5, y: 2.2}", "{x: 7.3, y: 2.31}")
    opened.page.keyboard.press("Control+z")
    opened.until("editor.history.before.length === 0")
    settle(opened)
    assert text(opened) == TEXT
    opened.page.keyboard.press("Control+y")
    settle(opened)
    assert "{x: 7.3, y: 2.31}" in text(opened)


def test_typing_moves_the_map_and_shows_problems_where_they_are(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    opened.page.fill("#text", TEXT.replace("x: 7.5, y: 2.2", "x: 4.5, y: 3.9"))
    opened.until("editor.problems.length > 0")
    assert opened.page.evaluate("editor.scene.objects.find((one) => one.id === 'goals/0').handles[0].x") == 4.5
    assert opened.page.evaluate("editor.bad.get('goals/0')") == "error"
    assert "16:" in opened.page.inner_text("#problems") and "inside obstacle" in opened.page.inner_text("#problems")
    assert opened.page.inner_text("#gutter .error") == "16"
    opened.page.fill("#text", TEXT + "raduis: 1\n")
    opened.until("editor.problems.some((one) => one.code === 'SC012')")


def test_saving_writes_the_bytes_of_the_text_and_nothing_before(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    drag(opened, (7.5, 2.2), (7.0, 1.2))
    assert hall.read_text() == TEXT
    opened.page.keyboard.press("Control+s")
    opened.until("editor.isSaved")
    assert changes(TEXT, hall.read_text()) == [("7.5", "7.0"), ("2.2", "1.2")]


def test_a_file_that_changed_meanwhile_is_not_overwritten_unasked(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    drag(opened, (7.5, 2.2), (7.0, 1.2))
    hall.write_text("theirs: 1\n")
    opened.page.click("#save")
    opened.until("document.getElementById('conflict').open")
    assert hall.read_text() == "theirs: 1\n"
    assert "was changed by another program" in opened.page.inner_text("#conflict")
    opened.page.click("#overwrite")
    opened.until("editor.isSaved")
    assert "{x: 7.0, y: 1.2}" in hall.read_text()
    opened.forgive("console: Failed to load resource: the server responded with a status of 409")


def test_a_form_changes_one_value_and_a_new_key_comes_with_help(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    opened.page.get_by_role("button", name="anna at").click()
    opened.page.get_by_label("Add a key to pedestrian").select_option(label="speed")
    opened.until("editor.text.includes('speed')")
    settle(opened)
    speed = opened.page.get_by_label("speed", exact=True)
    speed.fill("0.8 m/s")
    speed.press("Enter")
    opened.until("editor.text.includes('0.8 m/s')")
    settle(opened)
    assert changes(TEXT, text(opened)) == [("", ", speed: 0.8 m/s")]
    assert "Preferred speed" in opened.page.inner_text("#details")


def test_adding_and_deleting_with_the_mouse_and_the_keyboard(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    opened.page.select_option("#add", "Goal")
    opened.page.click("#place")
    opened.page.mouse.click(*pixel(opened, 6, 1.5))
    opened.until("editor.selected === 'goals/1'")
    settle(opened)
    added = "\n  - name: target\n    pose: {x: 6, y: 1.5, yaw: 0 deg}\n"
    assert text(opened) == TEXT.replace("\n    pose: {x: 7.5, y: 2.2}\n", "\n    pose: {x: 7.5, y: 2.2}" + added)
    opened.page.get_by_role("button", name="target at").focus()
    opened.page.keyboard.press("Delete")
    opened.until("editor.history.before.length === 2")
    settle(opened)
    assert text(opened) == TEXT


def test_the_shortest_path_and_the_clearance_follow_while_dragging(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    opened.page.evaluate("editor.select('goals/0')")
    settle(opened)
    assert "shortest path 6.50 m" in opened.page.inner_text("#facts")
    opened.page.mouse.move(*pixel(opened, 7.5, 2.2))
    opened.page.mouse.down()
    opened.page.mouse.move(*pixel(opened, 5, 2))
    opened.until("document.getElementById('facts').textContent.includes('4.00 m')")
    assert text(opened) == TEXT
    opened.page.keyboard.press("Escape")
    opened.page.mouse.up()
    settle(opened)
    assert text(opened) == TEXT


def test_a_run_shows_its_verdicts_and_the_replay_beside_the_map(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    opened.page.click("#run")
    opened.until("document.getElementById('outcome') !== null")
    assert "passed" in opened.page.inner_text("#outcome")
    assert "goals_reached" in opened.page.inner_text("#runpanel table")
    frame = opened.page.frame_locator("#runpanel iframe")
    frame.locator("html[data-ready]").wait_for(state="attached")
    assert hall.read_text() == TEXT


def test_things_of_a_world_in_another_file_are_edited_on_their_own_page(edit: Edit, tmp_path: Path) -> None:
    (tmp_path / "hall.world.yaml").write_text(
        "simscen: 1\nobstacles: [{name: rack, box: [1, 1, 1], pose: {x: 4, y: 4}}]\n"
    )
    file = tmp_path / "a.scenario.yaml"
    file.write_text("simscen: 1\nworld: hall.world.yaml\nrobot: {pose: {x: 1, y: 1}}\ngoals: [{pose: {x: 2, y: 2}}]\n")
    opened = edit(file)
    opened.page.get_by_role("button", name="rack").click()
    settle(opened)
    with opened.page.expect_popup() as popup:
        opened.page.get_by_role("link", name="Edit hall.world.yaml").click()
    world = popup.value
    world.wait_for_selector("html[data-checked]", state="attached")
    world.get_by_role("button", name="rack").click()
    world.keyboard.press("ArrowRight")
    world.wait_for_timeout(600)
    world.keyboard.press("Control+s")
    world.wait_for_timeout(600)
    assert "pose: {x: 4.1, y: 4}" in (tmp_path / "hall.world.yaml").read_text()
    world.close()
    opened.page.evaluate("editor.refresh()")
    opened.until("editor.scene.objects.some((one) => one.label === 'rack' && one.handles[0].x === 4.1)")


def test_a_world_file_is_edited_on_its_own_map(edit: Edit, tmp_path: Path) -> None:
    file = tmp_path / "hall.world.yaml"
    before = "simscen: 1\nobstacles:\n- name: rack\n  box: [1, 1, 1]\n  pose: {x: 400 cm, y: 4}  # here\n"
    file.write_text(before)
    opened = edit(file, "world")
    opened.page.get_by_role("button", name="rack").click()
    for _ in range(3):
        opened.page.keyboard.press("ArrowRight")
    opened.until("editor.history.before.length === 1 && !editor.keyMove")
    settle(opened)
    assert text(opened) == before.replace("400 cm", "430 cm")


SHIPPED = (
    "scenarios/corner_cases/u_trap.scenario.yaml",
    "scenarios/ground/ramp_up_and_over.scenario.yaml",
    "scenarios/corner_cases/narrow_doorway.scenario.yaml",
    "scenarios/people/group_in_the_way.scenario.yaml",
    "scenarios/multi_robot/meet_in_corridor.scenario.yaml",
    "scenarios/obstacles/cart_crossing.scenario.yaml",
    "scenarios/localization/wrong_initial_estimate.scenario.yaml",
    "scenarios/ground/oil_on_the_way.scenario.yaml",
    "worlds/office.world.yaml",
    "worlds/hospital.world.yaml",
)
MOVABLE = (
    "editor.scene.objects.filter((one) => one.editable && one.handles.some((each) => !each.place)).map((one) => one.id)"
)


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", SHIPPED)
def test_editing_a_shipped_file_changes_no_byte_that_was_not_edited(edit: Edit, tmp_path: Path, name: str) -> None:
    for folder in ("scenarios", "worlds"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    file = tmp_path / name
    before = file.read_bytes()
    opened = edit(file, "world" if ".world." in name else "scenario", root=tmp_path)
    moved = opened.page.evaluate(MOVABLE)[:3]
    assert moved
    for count, one in enumerate(moved, 1):
        opened.page.locator(f'#list button[data-id="{one}"]').click()
        opened.page.keyboard.press("ArrowRight")
        opened.page.keyboard.press("ArrowUp")
        opened.until(f"editor.history.before.length === {count} && !editor.keyMove")
        settle(opened)
    opened.page.keyboard.press("Control+s")
    opened.until("editor.isSaved")
    found = changes(before.decode(), file.read_bytes().decode())
    assert 2 * len(moved) - 1 <= len(found)
    assert all(re.fullmatch(r"-?[\d.]+", part) for pair in found for part in pair), found
    numbers = [float(after) - float(old) for old, after in found]
    assert all(abs(abs(step) - 0.1) < 1e-9 for step in numbers), "each number moved by the step of an arrow key"
    for _ in moved:
        opened.page.keyboard.press("Control+z")
    opened.until("editor.history.before.length === 0")
    settle(opened)
    assert text(opened) == before.decode()


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_the_modules_that_need_no_page() -> None:
    command = ["node", "--test", "--test-reporter=tap", str(ROOT / "tests/browser/editor.test.mjs")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stdout


def test_steps_of_the_keys_add_up_however_fast_they_come(edit: Edit, hall: Path) -> None:
    opened = edit(hall)
    opened.page.get_by_role("button", name="goal shelf").click()
    for count in range(12):
        opened.page.keyboard.press("ArrowLeft")
        opened.page.wait_for_timeout(count * 20)
    opened.page.get_by_role("button", name="rack at").click()
    opened.page.keyboard.press("ArrowLeft")
    opened.page.keyboard.press("Control+z")
    opened.page.keyboard.press("Control+y")
    opened.until("!editor.keyMove && editor.text.includes('x: 4.4')")
    settle(opened)
    assert text(opened) == TEXT.replace("{x: 7.5, y: 2.2}", "{x: 6.3, y: 2.2}").replace(
        "x: 4.5, y: 4}", "x: 4.4, y: 4}"
    )


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("size", [(1280, 800), (390, 800)])
def test_the_page_is_usable_at_any_width_and_by_screen_readers(
    edit: Edit, hall: Path, axe: str, dark: bool, size: tuple[int, int]
) -> None:
    opened = edit(hall, dark=dark, size=size)
    opened.page.evaluate("editor.select('robot')")
    settle(opened)
    assert opened.grave_findings(axe) == []
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= size[0]
