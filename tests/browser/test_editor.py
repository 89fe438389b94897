"""Tests of the editor in a browser: edits change the map, and only the affected values of the file."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from editor_page import TEXT, Edit, changes, drag, pixel, settle, text

ROOT = Path(__file__).parents[2]


def test_typing_updates_the_map_and_shows_problems_at_their_lines(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    tab.page.fill("#text", TEXT.replace("x: 7.5, y: 2.2", "x: 4.5, y: 3.9"))
    tab.until("editor.problems.length > 0")
    assert tab.page.evaluate("editor.scene.objects.find((one) => one.id === 'goals/0').handles[0].x") == 4.5
    assert tab.page.evaluate("editor.bad.get('goals/0')") == "error"
    assert "16:" in tab.page.inner_text("#problems") and "inside obstacle" in tab.page.inner_text("#problems")
    assert tab.page.inner_text("#gutter .error") == "16"
    tab.page.fill("#text", TEXT + "raduis: 1\n")
    tab.until("editor.problems.some((one) => one.code === 'SC012')")


def test_file_is_written_only_when_saved_with_the_exact_text(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    drag(tab, (7.5, 2.2), (7.0, 1.2))
    assert hall.read_text() == TEXT
    tab.page.keyboard.press("Control+s")
    tab.until("editor.isSaved")
    assert changes(TEXT, hall.read_text()) == [("7.5", "7.0"), ("2.2", "1.2")]


def test_file_changed_by_another_program_is_overwritten_only_after_confirmation(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    drag(tab, (7.5, 2.2), (7.0, 1.2))
    hall.write_text("theirs: 1\n")
    tab.page.click("#save")
    tab.until("document.getElementById('conflict').open")
    assert hall.read_text() == "theirs: 1\n"
    assert "was changed by another program" in tab.page.inner_text("#conflict")
    tab.page.click("#overwrite")
    tab.until("editor.isSaved")
    assert "{x: 7.0, y: 1.2}" in hall.read_text()
    tab.ignore_complaints("console: Failed to load resource: the server responded with a status of 409")


def test_form_changes_one_value_and_shows_help_for_a_new_key(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    tab.page.get_by_role("button", name="anna at").click()
    tab.page.get_by_label("Add a key to pedestrian").select_option(label="speed")
    tab.until("editor.text.includes('speed')")
    settle(tab)
    speed = tab.page.get_by_label("speed", exact=True)
    speed.fill("0.8 m/s")
    speed.press("Enter")
    tab.until("editor.text.includes('0.8 m/s')")
    settle(tab)
    assert changes(TEXT, text(tab)) == [("", ", speed: 0.8 m/s")]
    assert "Preferred speed" in tab.page.inner_text("#details")


def test_objects_are_added_and_deleted_by_mouse_and_keyboard(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    tab.page.select_option("#add", "Goal")
    tab.page.click("#place")
    tab.page.mouse.click(*pixel(tab, 6, 1.5))
    tab.until("editor.selected === 'goals/1'")
    settle(tab)
    added = "\n  - name: target\n    pose: {x: 6, y: 1.5, yaw: 0 deg}\n"
    assert text(tab) == TEXT.replace("\n    pose: {x: 7.5, y: 2.2}\n", "\n    pose: {x: 7.5, y: 2.2}" + added)
    tab.page.get_by_role("button", name="target at").focus()
    tab.page.keyboard.press("Delete")
    tab.until("editor.history.before.length === 2")
    settle(tab)
    assert text(tab) == TEXT


def test_run_shows_its_verdicts_and_replay_next_to_the_map(edit: Edit, hall: Path) -> None:
    tab = edit(hall)
    tab.page.click("#run")
    tab.until("document.getElementById('outcome') !== null")
    assert "passed" in tab.page.inner_text("#outcome")
    assert "goals_reached" in tab.page.inner_text("#runpanel table")
    frame = tab.page.frame_locator("#runpanel iframe")
    frame.locator("html[data-ready]").wait_for(state="attached")
    assert hall.read_text() == TEXT


def test_objects_of_another_world_file_are_edited_on_its_own_page(edit: Edit, tmp_path: Path) -> None:
    (tmp_path / "hall.world.yaml").write_text(
        "simscen: 1\nobstacles: [{name: rack, box: [1, 1, 1], pose: {x: 4, y: 4}}]\n"
    )
    file = tmp_path / "a.scenario.yaml"
    file.write_text("simscen: 1\nworld: hall.world.yaml\nrobot: {pose: {x: 1, y: 1}}\ngoals: [{pose: {x: 2, y: 2}}]\n")
    tab = edit(file)
    tab.page.get_by_role("button", name="rack").click()
    settle(tab)
    with tab.page.expect_popup() as popup:
        tab.page.get_by_role("link", name="Edit hall.world.yaml").click()
    world = popup.value
    world.wait_for_selector("html[data-checked]", state="attached")
    world.get_by_role("button", name="rack").click()
    world.keyboard.press("ArrowRight")
    world.wait_for_timeout(600)
    world.keyboard.press("Control+s")
    world.wait_for_timeout(600)
    assert "pose: {x: 4.1, y: 4}" in (tmp_path / "hall.world.yaml").read_text()
    world.close()
    tab.page.evaluate("editor.refresh()")
    tab.until("editor.scene.objects.some((one) => one.label === 'rack' && one.handles[0].x === 4.1)")


def test_a_world_file_is_edited_on_its_own_map(edit: Edit, tmp_path: Path) -> None:
    file = tmp_path / "hall.world.yaml"
    original = "simscen: 1\nobstacles:\n- name: rack\n  box: [1, 1, 1]\n  pose: {x: 400 cm, y: 4}  # here\n"
    file.write_text(original)
    tab = edit(file, "world")
    tab.page.get_by_role("button", name="rack").click()
    for _ in range(3):
        tab.page.keyboard.press("ArrowRight")
    tab.until("editor.history.before.length === 1 && !editor.keyMove")
    settle(tab)
    assert text(tab) == original.replace("400 cm", "430 cm")


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


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", SHIPPED)
def test_edit_of_a_shipped_file_changes_only_the_edited_bytes(edit: Edit, tmp_path: Path, name: str) -> None:
    for folder in ("scenarios", "worlds"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    file = tmp_path / name
    original = file.read_bytes()
    tab = edit(file, "world" if ".world." in name else "scenario", root=tmp_path)
    object_ids = tab.page.evaluate(MOVABLE)[:3]
    assert object_ids
    for count, object_id in enumerate(object_ids, 1):
        tab.page.locator(f'#list button[data-id="{object_id}"]').click()
        tab.page.keyboard.press("ArrowRight")
        tab.page.keyboard.press("ArrowUp")
        tab.until(f"editor.history.before.length === {count} && !editor.keyMove")
        settle(tab)
    tab.page.keyboard.press("Control+s")
    tab.until("editor.isSaved")
    changed_words = changes(original.decode(), file.read_bytes().decode())
    assert 2 * len(object_ids) - 1 <= len(changed_words)
    assert all(re.fullmatch(r"-?[\d.]+", part) for pair in changed_words for part in pair), changed_words
    numbers = [float(new) - float(old) for old, new in changed_words]
    assert all(abs(abs(step) - 0.1) < 1e-9 for step in numbers), "each number moved by the step of an arrow key"
    for _ in object_ids:
        tab.page.keyboard.press("Control+z")
    tab.until("editor.history.before.length === 0")
    settle(tab)
    assert text(tab) == original.decode()


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_javascript_modules_of_the_editor_pass_their_tests() -> None:
    command = ["node", "--test", "--test-reporter=tap", str(ROOT / "tests/browser/editor.test.mjs")]
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize(("size", "dark"), [((1280, 800), False), ((390, 800), True)])
def test_the_page_is_usable_at_any_width_and_by_screen_readers(
    edit: Edit, hall: Path, axe: str, dark: bool, size: tuple[int, int]
) -> None:
    tab = edit(hall, dark=dark, size=size)
    tab.page.evaluate("editor.select('robot')")
    settle(tab)
    assert tab.severe_findings(axe) == []
    assert tab.page.evaluate("document.documentElement.scrollWidth") <= size[0]
