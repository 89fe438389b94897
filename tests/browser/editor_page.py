"""Helpers of the editor tests: mouse actions, text, and the edited scenario."""

import re
import sys
from collections.abc import Callable
from difflib import SequenceMatcher
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from rig import Opened

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


def settle(opened: Opened) -> None:
    """Wait until the page has finished all updates."""
    opened.until(
        "!editor.keyMove && !editor.previewing && document.documentElement.dataset.checked === "
        "String(editor.history.before.length)"
    )


def pixel(opened: Opened, x: float, y: float) -> tuple[float, float]:
    """Return the screen position of a point in the world."""
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
    """Return pairs of old and new words where the texts differ."""
    words = [re.findall(r"[\w.-]+|\W", one) for one in (before, after)]
    steps = SequenceMatcher(None, *words, autojunk=False).get_opcodes()
    return [("".join(words[0][a:b]), "".join(words[1][c:d])) for what, a, b, c, d in steps if what != "equal"]
