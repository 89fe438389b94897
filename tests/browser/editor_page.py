"""Helpers of the editor tests: a scenario, mouse actions, and changes of the text."""

import re
import sys
from collections.abc import Callable
from difflib import SequenceMatcher
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from browser_tab import BrowserTab

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
Edit = Callable[..., BrowserTab]


def settle(tab: BrowserTab) -> None:
    """Wait until the page has finished all updates."""
    tab.until(
        "!editor.keyMove && !editor.previewing && document.documentElement.dataset.checked === "
        "String(editor.history.before.length)"
    )


def pixel(tab: BrowserTab, x: float, y: float) -> tuple[float, float]:
    """Return the screen position of a point in the world."""
    script = (
        "([x, y]) => { const b = editor.view.canvas.getBoundingClientRect(); const [u, v] = editor.view.pixel(x, y);"
    )
    u, v = tab.page.evaluate(script + " return [b.left + u, b.top + v]; }", [x, y])
    return u, v


def drag(tab: BrowserTab, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag with the mouse between two points of the world."""
    edit_count = tab.page.evaluate("editor.history.before.length")
    mouse = tab.page.mouse
    mouse.move(*pixel(tab, *start))
    mouse.down()
    mouse.move(*pixel(tab, *((a + b) / 2 for a, b in zip(start, end, strict=True))))
    mouse.move(*pixel(tab, *end))
    mouse.up()
    tab.until(f"editor.history.before.length > {edit_count}")
    settle(tab)


def text(tab: BrowserTab) -> str:
    """Return the text in the editor."""
    content = tab.page.input_value("#text")
    assert content == tab.page.evaluate("editor.text")
    return str(content)


def changes(old: str, new: str) -> list[tuple[str, str]]:
    """Return pairs of old and new words where the texts differ."""
    words = [re.findall(r"[\w.-]+|\W", content) for content in (old, new)]
    steps = SequenceMatcher(None, *words, autojunk=False).get_opcodes()
    return [("".join(words[0][a:b]), "".join(words[1][c:d])) for kind, a, b, c, d in steps if kind != "equal"]
