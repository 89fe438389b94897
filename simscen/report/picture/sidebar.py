"""Sidebar of the picture of a run: error, criteria with their results, and legend."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import Status
from simscen.judge.finding_text import comparison, subject, time_and_place
from simscen.report.picture import palette
from simscen.report.picture.canvas import Fill, TextItem, draw_text, font, printable
from simscen.report.picture.event_layer import DIAMOND, FLAG, SMALL_DIAMOND
from simscen.report.picture.palette import Color
from simscen.report.picture.path_layer import round_time_step
from simscen.report.picture.scene import Scene

WIDTH_PX = 360
_PADDING_PX = 18
_LINE_HEIGHT_PX, _TEXT_SIZE_PX = 17, 13
_STATUS_ORDER = (Status.ERROR, Status.FAIL, Status.INCONCLUSIVE, Status.PASS)
Pen = ImageDraw.ImageDraw
Points = Sequence[tuple[float, float]]
Shape = tuple[str, Points, dict[str, Any]]
"""Part of a symbol: method of ImageDraw, points in px from the center of the symbol's left edge, and options."""
CriterionRow = tuple[Status, Color, list[str]]
"""Status of a criterion, its color, and lines of text."""


def draw_sidebar(scene: Scene, parts: Sequence[str], min_height: int) -> Image.Image:
    """Return the sidebar, which is at least `min_height` pixels high.

    `parts` are the names of the drawn parts of the map. The legend explains these parts, and always the true path and
    the plans.
    """
    reasons, rows = _reason_lines(scene), _criterion_rows(scene)
    legend = [entry[1:] for entry in _legend(round_time_step(scene.result.simulated)) if _is_drawn(parts, entry[0])]
    text_height = (
        len(reasons) * _LINE_HEIGHT_PX
        + (14 if reasons else 0)
        + sum(_LINE_HEIGHT_PX * len(lines) + 8 for _, _, lines in rows)
    )
    height = max(min_height, 54 + text_height + 26 + 20 * len(legend) + 62)
    image = Image.new("RGB", (WIDTH_PX, height), palette.PAGE)
    draw = ImageDraw.Draw(image, "RGBA")
    _draw_criteria(draw, reasons, rows)
    top = image.height - 20 * len(legend) - 50
    for number, (text, symbol) in enumerate(legend):
        y = top + 20 * number
        _draw_shapes(draw, _PADDING_PX, y, symbol)
        draw_text(draw, TextItem(_PADDING_PX + 34, y, text, 12, palette.FAINT_INK))
    _draw_time_bar(draw, scene, image.height - 30)
    return image


def _is_drawn(parts: Sequence[str], word: str) -> bool:
    """Return whether one of the names in `parts` starts or ends with `word`."""
    return any(part.startswith(word) or part.endswith(f" {word}") for part in parts)


def _reason_lines(scene: Scene) -> list[str]:
    """Return the error of a run, or the reason of a skipped run or expected failure, as lines; otherwise []."""
    result = scene.result
    if result.error is not None:
        return _wrap(printable(f"{result.error.kind}: {result.error.message}"), _PADDING_PX)
    if result.outcome in (Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED):
        return _wrap(printable(f"{result.outcome.value.replace('-', ' ')}: {result.reason}"), _PADDING_PX)
    return []


def _criterion_rows(scene: Scene) -> list[CriterionRow]:
    """Return a row for each criterion, in the order of _STATUS_ORDER."""
    rows: list[CriterionRow] = []
    for verdict in sorted(scene.result.verdicts, key=lambda verdict: _STATUS_ORDER.index(verdict.status)):
        finding = verdict.tightest
        is_warning = verdict.severity == "warn" and verdict.status is not Status.PASS
        color = palette.AMBER if is_warning else palette.STATUS_COLORS[verdict.status]
        if finding is None:
            rows.append((verdict.status, color, _wrap(f"{printable(verdict.id)}: no findings")))
            continue
        has_passed = verdict.status is Status.PASS
        where = "" if has_passed else time_and_place(finding, scene.result.tick_rate)
        text = ", ".join(part for part in (f"{subject(verdict, finding)}: {comparison(finding)}", where) if part)
        texts = [f"warning: {text}" if is_warning else text, *(() if has_passed else finding.detail)]
        rows.append((verdict.status, color, [line for text in texts for line in _wrap(printable(text))]))
    return rows


def _draw_criteria(draw: Pen, reasons: list[str], rows: list[CriterionRow]) -> None:
    y = 24.0
    for line in reasons:
        draw_text(draw, TextItem(_PADDING_PX, y, line, _TEXT_SIZE_PX, palette.INK))
        y += _LINE_HEIGHT_PX
    y += 14 if reasons else 0
    draw_text(draw, TextItem(_PADDING_PX, y, "criteria", 12, palette.FAINT_INK))
    y += 22
    for status, color, lines in rows:
        check_mark = [_line(((0, 0), (4, 4), (10, -5)), color)]
        _draw_shapes(draw, _PADDING_PX, y, check_mark if status is Status.PASS else _cross(5, color))
        for line in lines:
            draw_text(draw, TextItem(_PADDING_PX + 20, y, line, _TEXT_SIZE_PX, palette.INK))
            y += _LINE_HEIGHT_PX
        y += 8


def _wrap(text: str, left: int = _PADDING_PX + 20) -> list[str]:
    """Wrap a text that starts at the pixel column `left`. Words longer than a line are split."""
    available, text_font = WIDTH_PX - left - 12, font(_TEXT_SIZE_PX)
    lines, current = [], ""
    for word in text.split(" "):
        longer = f"{current} {word}".strip()
        if current and text_font.getlength(longer) > available:
            lines.append(current)
            longer = word
        while text_font.getlength(longer) > available:
            lengths = range(len(longer) - 1, 0, -1)
            length = next(k for k in lengths if k == 1 or text_font.getlength(longer[:k]) <= available)
            lines.append(longer[:length])
            longer = longer[length:]
        current = longer
    return [*lines, current]


def _line(points: Points, color: Color, width: int = 2) -> Shape:
    return "line", points, {"fill": color, "width": width}


def _area(kind: str, points: Points, color: Fill, outline: Color | None = None, width: int = 1) -> Shape:
    return kind, points, {"fill": color, "outline": outline, **({} if outline is None else {"width": width})}


def _cross(x: float, color: Color) -> list[Shape]:
    return [_line(((x - 4, -4), (x + 4, 4)), color), _line(((x - 4, 4), (x + 4, -4)), color)]


def _block(color: Color) -> list[Shape]:
    return [_area("rectangle", ((3, -6), (21, 6)), (*color, 110), color)]


def _goal(color: Color) -> Shape:
    return _area("ellipse", ((5, -7), (19, 7)), (*color, 46), color, 2)


def _draw_shapes(draw: Pen, x: float, y: float, shapes: Iterable[Shape]) -> None:
    for kind, points, options in shapes:
        getattr(draw, kind)([(x + dx, y + dy) for dx, dy in points], **options)


def _legend(step: float) -> list[tuple[str, str, list[Shape]]]:
    """Return the entries of the legend as (word for `_is_drawn`, text, symbol). Entries with the word "" always appear.

    `step` is the time between two dots on the true path in s.
    """
    p = palette
    path = [_line(((k, 0), (k + 1, 0)), p.time_color(k / 24), 3) for k in range(24)]
    path.append(_area("ellipse", ((8, -4), (16, 4)), p.PAGE, p.time_color(0.5), 2))
    arrow = [_line(((12, 6), (12, -3)), p.AMBER, 3), _area("polygon", ((7, -2), (12, -8), (17, -2)), p.AMBER)]
    robot = [_area("rectangle", ((4, -6), (20, 6)), p.START, p.ROBOT)]
    robot.append(_area("polygon", ((13, -3), (18, 0), (13, 3)), p.PAGE))
    door = [_area("rectangle", ((2, -2), (22, 2)), (*p.OBJECT, 150), p.OBJECT)]
    door += [_line(((2, -2 - 3 * k), (2, -3 - 3 * k)), p.OBJECT, 1) for k in range(3)]
    person = [_area("ellipse", ((6, -6), (18, 6)), (*p.PEDESTRIAN, 150), p.PEDESTRIAN)]
    person.append(_line(((12, 0), (23, 0)), p.PEDESTRIAN))
    fault = [_line(((0, 0), (24, 0)), p.FAULTY, 10)]
    fault.append(_area("polygon", ((13, -8), (8, 1), (12, 1), (11, 8), (17, -2), (13, -2)), p.AMBER))
    corners = [(12 + 7 * math.cos(angle), 7 * math.sin(angle)) for angle in np.radians(range(234, 594, 72)).tolist()]
    diamond, small_diamond, flag = (
        [(12 + x, y + down) for x, y in symbol] for symbol, down in ((DIAMOND, 0), (SMALL_DIAMOND, 0), (FLAG, 9))
    )
    return [
        ("", f"true path, a dot every {step:g} s", path),
        ("belief", "estimated path", [_line(((10 * k, 0), (10 * k + 5, 0)), p.BELIEF) for k in range(3)]),
        ("", "plans", [_line(((0, 0), (24, 0)), p.PLAN, 4)]),
        ("set down", "robot lifted and set down elsewhere", arrow),
        ("goal", "goal, its tolerance and heading", [_goal(p.GREEN), _line(((12, 0), (25, 0)), p.GREEN)]),
        ("failed", "goal that failed", [_goal(p.RED), *_cross(12, p.RED)]),
        ("robot", "robot at the end", robot),
        ("object", "object at the end; before: color of the time", _block(p.OBJECT)),
        ("door", "door at the end; dashed: open and closed", door),
        ("person", "person at the end, with heading", person),
        ("keepout zone", "keepout zone", [_line(((7 * k, -6), (7 * k + 9, 6)), p.RED, 1) for k in range(3)]),
        ("speed zone", "zone with a speed limit", [_line(((7 * k, 6), (7 * k + 9, -6)), p.AMBER, 1) for k in range(3)]),
        ("ground", "ramp or sill; chevrons point uphill", _block(p.GROUND)),
        ("floor", "floor with different friction", _block(p.SLIPPERY)),
        ("fault", "start of a fault; band: fault active", fault),
        ("event", "robot at an event", [_area("polygon", diamond, p.INK)]),
        ("mark", "robot at a mark", [_area("polygon", flag, p.AMBER)]),
        ("place", "named place", [_area("polygon", small_diamond, p.PLACE)]),
        ("collision", "collision", [_area("polygon", corners, p.RED)]),
        ("violation", "violated criterion", _cross(12, p.RED)),
    ]


def _draw_time_bar(draw: Pen, scene: Scene, y: float) -> None:
    """Draw the color scale of the true path, from the start to the end of the run, around the row `y`."""
    end = f"{scene.result.simulated:.0f} s"
    left, right = _PADDING_PX + 34, WIDTH_PX - _PADDING_PX - math.ceil(font(12).getlength(end)) - 8
    draw_text(draw, TextItem(_PADDING_PX, y, "0 s", 12, palette.FAINT_INK))
    for x in range(left, right):
        draw.line([(x, y - 4), (x, y + 4)], fill=palette.time_color((x - left) / (right - left)))
    draw_text(draw, TextItem(right + 8, y, end, 12, palette.FAINT_INK))
