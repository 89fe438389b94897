"""Colors of pictures and pages.

The hues are from Okabe and Ito (2008), and are distinguishable with color blindness: bluish green for good,
vermilion for bad, amber for warnings. They are darkened for a text contrast of 4.5 to 1 on white. Pictures and pages
always combine colors with symbols.
"""

from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import Status

Color = tuple[int, int, int]
"""Red, green, and blue from 0 to 255."""

PAGE: Color = (255, 255, 255)
"""Background of pictures."""
FREE: Color = (252, 251, 249)
UNKNOWN: Color = (226, 223, 216)
WALL: Color = (58, 63, 71)
"""Colors of free, unknown, and occupied cells of a map."""
INK: Color = (38, 42, 48)
FAINT_INK: Color = (98, 103, 111)
"""Colors of text, and of less important text."""
RULE: Color = (222, 224, 227)
"""Color of separating lines."""
GRID = (38, 42, 48, 24)
"""Color of grid lines with an opacity of 24, so that they are visible on free space, but not on walls."""
BELIEF: Color = (20, 20, 24)
PLAN: Color = (176, 203, 232)
PLACE: Color = (112, 116, 124)
START: Color = (96, 102, 110)
ROBOT: Color = (30, 34, 40)
OBJECT: Color = (0, 105, 148)
PEDESTRIAN: Color = (122, 62, 130)
GROUND: Color = (196, 176, 140)
FAULTY: Color = (240, 208, 148)
SLIPPERY: Color = (60, 140, 190)
"""Colors of drawn parts. FAULTY marks the path during a fault, SLIPPERY a floor with another friction."""
RED: Color = (194, 48, 16)
AMBER: Color = (150, 98, 0)
GREEN: Color = (0, 113, 86)
GRAY: Color = (98, 103, 111)
"""Colors of outcomes and statuses."""
ROBOTS: tuple[Color, ...] = ((30, 34, 40), (0, 113, 86), (122, 62, 130), (150, 98, 0), (0, 105, 148))
"""Outline colors of the paths of several robots, in the order of the robot names. Further robots repeat the colors."""

OUTCOME_COLORS = {
    Outcome.PASSED: GREEN,
    Outcome.FAILED: RED,
    Outcome.ERROR: AMBER,
    Outcome.FAILED_AS_EXPECTED: GRAY,
    Outcome.SKIPPED: GRAY,
}
STATUS_COLORS = {Status.PASS: GREEN, Status.FAIL: RED, Status.INCONCLUSIVE: AMBER, Status.ERROR: AMBER}

_TIME_COLORS = ((40, 60, 160), (110, 40, 170), (185, 40, 130), (225, 85, 75), (240, 150, 30))
"""Color scale of the time of a run, at equal distances from its start to its end."""


def time_color(fraction: float) -> Color:
    """Return the color for a time in the run: dark blue at its start (0), orange at its end (1)."""
    position = min(max(fraction, 0.0), 1.0) * (len(_TIME_COLORS) - 1)
    low = min(int(position), len(_TIME_COLORS) - 2)
    ends = zip(_TIME_COLORS[low], _TIME_COLORS[low + 1], strict=True)
    r, g, b = (round(start + (position - low) * (end - start)) for start, end in ends)
    return r, g, b


LIGHT = {
    "page": "#ffffff", "panel": "#f5f6f7", "rule": "#dcdfe3", "ink": "#262a30", "quiet": "#5c626b",
    "good": "#00624b", "bad": "#b02a0c", "odd": "#7d5200", "link": "#00568c", "focus": "#00568c",
}  # fmt: skip
DARK = {
    "page": "#15181c", "panel": "#1e2329", "rule": "#363d46", "ink": "#e7eaee", "quiet": "#a3abb6",
    "good": "#4fc9a2", "bad": "#ff8a66", "odd": "#e9b44c", "link": "#7cc4f5", "focus": "#7cc4f5",
}  # fmt: skip
"""Light and dark theme of the pages. `odd` is the color of warnings and errors. Text has a contrast of 4.5 to 1."""


def css_variables() -> str:
    """Return both themes as CSS variables (`--good`, …).

    The attribute `data-theme` of the root element selects a theme. The default is the setting of the browser.
    """
    light, dark = ("".join(f"--{name}:{value};" for name, value in theme.items()) for theme in (LIGHT, DARK))
    return (
        f":root{{color-scheme:light dark;{light}}}\n@media (prefers-color-scheme:dark){{:root{{{dark}}}}}\n"
        f':root[data-theme="light"]{{color-scheme:light;{light}}}\n'
        f':root[data-theme="dark"]{{color-scheme:dark;{dark}}}\n'
    )
