"""The colors of pictures and pages: told apart in gray and by the color-blind, and never by color alone.

Hues are those of Okabe and Ito (2008), darkened until text in them has a contrast of 4.5 to 1 on white: good is a
bluish green, bad vermilion, odd amber, which differ in blue and lightness as well. On the way of a robot time goes from
dark blue to light orange. What failed has a cross beside its color, what passed a tick.
"""

from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import Status

Color = tuple[int, int, int]

PAGE: Color = (255, 255, 255)
FREE: Color = (252, 251, 249)
UNKNOWN: Color = (226, 223, 216)
WALL: Color = (58, 63, 71)
INK: Color = (38, 42, 48)
FAINT_INK: Color = (98, 103, 111)
RULE: Color = (222, 224, 227)
GRID = (38, 42, 48, 24)
"""Seen on the floor, and not on walls."""
BELIEF: Color = (20, 20, 24)
PLAN: Color = (176, 203, 232)
PLACE: Color = (112, 116, 124)
START: Color = (96, 102, 110)
ROBOT: Color = (30, 34, 40)
OBJECT: Color = (0, 105, 148)
PERSON: Color = (122, 62, 130)
GROUND: Color = (196, 176, 140)
FAULTY: Color = (240, 208, 148)
SLIPPERY: Color = (60, 140, 190)
RED: Color = (194, 48, 16)
AMBER: Color = (150, 98, 0)
GREEN: Color = (0, 113, 86)
GRAY: Color = (98, 103, 111)
GOAL = GREEN
ROBOTS: tuple[Color, ...] = ((30, 34, 40), (0, 113, 86), (122, 62, 130), (150, 98, 0), (0, 105, 148))
"""The rims of the ways of several robots, in the order of their names."""

OUTCOMES = {
    Outcome.PASSED: GREEN,
    Outcome.FAILED: RED,
    Outcome.ERROR: AMBER,
    Outcome.FAILED_AS_EXPECTED: GRAY,
    Outcome.SKIPPED: GRAY,
}
STATUSES = {Status.PASS: GREEN, Status.FAIL: RED, Status.INCONCLUSIVE: AMBER, Status.ERROR: AMBER}
SIGNS = {Status.PASS: "✓", Status.FAIL: "✗", Status.INCONCLUSIVE: "?", Status.ERROR: "!"}

_STOPS = ((40, 60, 160), (110, 40, 170), (185, 40, 130), (225, 85, 75), (240, 150, 30))


def time_color(share: float) -> Color:
    """The color of a share 0 … 1 of the run's time, from deep blue over purple to orange."""
    at = min(max(share, 0.0), 1.0) * (len(_STOPS) - 1)
    low = min(int(at), len(_STOPS) - 2)
    r, g, b = (round(a + (at - low) * (z - a)) for a, z in zip(_STOPS[low], _STOPS[low + 1], strict=True))
    return r, g, b


LIGHT = {
    "page": "#ffffff", "panel": "#f5f6f7", "rule": "#dcdfe3", "ink": "#262a30", "quiet": "#5c626b",
    "good": "#00624b", "bad": "#b02a0c", "odd": "#7d5200", "link": "#00568c", "focus": "#00568c",
}  # fmt: skip
DARK = {
    "page": "#15181c", "panel": "#1e2329", "rule": "#363d46", "ink": "#e7eaee", "quiet": "#a3abb6",
    "good": "#4fc9a2", "bad": "#ff8a66", "odd": "#e9b44c", "link": "#7cc4f5", "focus": "#7cc4f5",
}  # fmt: skip
"""The pages' own, for light and dark surroundings; each of the texts has 4.5 to 1 on `page` and on `panel`."""


def css_variables() -> str:
    """Both themes as variables of CSS (`--good`, …), dark where the reader's system is."""
    light, dark = ("".join(f"--{name}:{value};" for name, value in theme.items()) for theme in (LIGHT, DARK))
    return (
        f":root{{color-scheme:light dark;{light}}}\n@media (prefers-color-scheme:dark){{:root{{{dark}}}}}\n"
        f':root[data-theme="light"]{{color-scheme:light;{light}}}\n'
        f':root[data-theme="dark"]{{color-scheme:dark;{dark}}}\n'
    )
