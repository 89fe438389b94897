"""Sidebar of the picture of a run: error, criteria with their results, and legend."""

import math
from collections.abc import Callable, Sequence

from PIL import Image, ImageDraw

from simscen.core.records.run_result import Outcome
from simscen.core.records.verdict import Status
from simscen.judge.finding_text import comparison, subject, time_and_place
from simscen.report.picture import palette
from simscen.report.picture.canvas import TextItem, draw_text, font, printable
from simscen.report.picture.event_layer import DIAMOND, FLAG, SMALL_DIAMOND
from simscen.report.picture.palette import Color
from simscen.report.picture.path_layer import round_time_step
from simscen.report.picture.scene import Scene

WIDTH_PX = 360
_PADDING_PX = 18
_LINE_HEIGHT_PX, _TEXT_SIZE_PX = 17, 13
_STATUS_ORDER = (Status.ERROR, Status.FAIL, Status.INCONCLUSIVE, Status.PASS)
Pen = ImageDraw.ImageDraw
DrawSymbol = Callable[[Pen, float, float], None]
"""Function that draws the symbol of a legend entry. Parameters: pen, x of the left edge and y of the center in px."""
CriterionRow = tuple[Status, Color, list[str]]
"""Status of a criterion, its color, and lines of text."""


def draw_sidebar(scene: Scene, parts: Sequence[str], min_height: int) -> Image.Image:
    """Return the sidebar, which is at least `min_height` pixels high.

    `parts` are the names of the drawn parts of the map. The legend explains path and plans, and these parts.
    """
    reasons, rows = _reasons(scene), _criteria(scene)
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
    for number, (text, draw_symbol) in enumerate(legend):
        y = top + 20 * number
        draw_symbol(draw, _PADDING_PX, y)
        draw_text(draw, TextItem(_PADDING_PX + 34, y, text, 12, palette.FAINT_INK))
    _draw_time_bar(draw, scene, image.height - 30)
    return image


def _is_drawn(parts: Sequence[str], word: str) -> bool:
    """Return whether one of the names in `parts` starts or ends with `word`."""
    return any(part.startswith(word) or part.endswith(f" {word}") for part in parts)


def _reasons(scene: Scene) -> list[str]:
    """Return the error of a run, or the reason of a skipped run or expected failure, as lines; otherwise []."""
    result = scene.result
    if result.error is not None:
        return _wrap(printable(f"{result.error.kind}: {result.error.message}"), _PADDING_PX)
    if result.outcome in (Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED):
        return _wrap(printable(f"{result.outcome.value.replace('-', ' ')}: {result.reason}"), _PADDING_PX)
    return []


def _criteria(scene: Scene) -> list[CriterionRow]:
    """Return a row for each criterion, in the order of _STATUS_ORDER."""
    rows: list[CriterionRow] = []
    for verdict in sorted(scene.result.verdicts, key=lambda verdict: _STATUS_ORDER.index(verdict.status)):
        finding = verdict.tightest
        is_warning = verdict.severity == "warn" and verdict.status is not Status.PASS
        color = palette.AMBER if is_warning else palette.STATUS_COLORS[verdict.status]
        if finding is None:
            rows.append((verdict.status, color, _wrap(f"{printable(verdict.id)}: checked nothing")))
            continue
        failed = verdict.status is not Status.PASS
        where = time_and_place(finding, scene.result.tick_rate) if failed else ""
        text = ", ".join(part for part in (f"{subject(verdict, finding)}: {comparison(finding)}", where) if part)
        texts = [f"warning: {text}" if is_warning else text, *(finding.detail if failed else ())]
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
        (_draw_check_mark if status is Status.PASS else _draw_cross)(draw, _PADDING_PX + 5, y, color)
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


def _draw_check_mark(draw: Pen, x: float, y: float, color: Color) -> None:
    draw.line([(x - 5, y), (x - 1, y + 4), (x + 5, y - 5)], fill=color, width=2)


def _draw_cross(draw: Pen, x: float, y: float, color: Color) -> None:
    draw.line([(x - 4, y - 4), (x + 4, y + 4)], fill=color, width=2)
    draw.line([(x - 4, y + 4), (x + 4, y - 4)], fill=color, width=2)


def _legend(step: float) -> list[tuple[str, str, DrawSymbol]]:
    """Return the entries of the legend: word for `_is_drawn` ("": always shown), text, and symbol.

    `step` is the time between two dots on the true path in s.
    """
    return [
        ("", f"true path, a dot every {step:g} s", _draw_path_symbol),
        ("belief", "estimated path", _draw_belief_symbol),
        ("", "plans", lambda d, x, y: d.line([(x, y), (x + 24, y)], fill=palette.PLAN, width=4)),
        ("set down", "robot lifted and set down elsewhere", _draw_kidnapping_symbol),
        ("goal", "goal, its tolerance and heading", _ring_symbol(palette.GREEN, False)),
        ("failed", "goal that failed", _ring_symbol(palette.RED, True)),
        ("robot", "robot at the end", _draw_robot_symbol),
        ("object", "object at the end; before: color of the time", _block_symbol(palette.OBJECT)),
        ("door", "door at the end; dashed: open and closed", _draw_door_symbol),
        ("person", "person at the end, with heading", _draw_pedestrian_symbol),
        ("keepout zone", "keepout zone", _hatched_symbol(palette.RED, -6)),
        ("speed zone", "zone with a speed limit", _hatched_symbol(palette.AMBER, 6)),
        ("ground", "ramp or sill; chevrons point uphill", _block_symbol(palette.GROUND)),
        ("floor", "floor with different friction", _block_symbol(palette.SLIPPERY)),
        ("fault", "start of a fault; band: fault active", _draw_fault_symbol),
        ("event", "robot at an event", _polygon_symbol(DIAMOND, palette.INK)),
        ("mark", "robot at a mark", _polygon_symbol([(x, y + 9) for x, y in FLAG], palette.AMBER)),
        ("place", "named place", _polygon_symbol(SMALL_DIAMOND, palette.PLACE)),
        ("collision", "collision", lambda d, x, y: d.regular_polygon((x + 12, y, 7), 5, fill=palette.RED)),
        ("violation", "violated criterion", lambda d, x, y: _draw_cross(d, x + 12, y, palette.RED)),
    ]


def _draw_path_symbol(draw: Pen, x: float, y: float) -> None:
    for k in range(24):
        draw.line([(x + k, y), (x + k + 1, y)], fill=palette.time_color(k / 24), width=3)
    draw.ellipse((x + 8, y - 4, x + 16, y + 4), fill=palette.PAGE, outline=palette.time_color(0.5), width=2)


def _draw_robot_symbol(draw: Pen, x: float, y: float) -> None:
    draw.rectangle((x + 4, y - 6, x + 20, y + 6), fill=palette.START, outline=palette.ROBOT)
    draw.polygon([(x + 13, y - 3), (x + 18, y), (x + 13, y + 3)], fill=palette.PAGE)


def _draw_belief_symbol(draw: Pen, x: float, y: float) -> None:
    for k in range(3):
        draw.line([(x + 10 * k, y), (x + 10 * k + 5, y)], fill=palette.BELIEF, width=2)


def _draw_kidnapping_symbol(draw: Pen, x: float, y: float) -> None:
    draw.line([(x + 12, y + 6), (x + 12, y - 3)], fill=palette.AMBER, width=3)
    draw.polygon([(x + 7, y - 2), (x + 12, y - 8), (x + 17, y - 2)], fill=palette.AMBER)


def _ring_symbol(color: Color, is_crossed: bool) -> DrawSymbol:
    def draw_symbol(draw: Pen, x: float, y: float) -> None:
        draw.ellipse((x + 5, y - 7, x + 19, y + 7), fill=(*color, 46), outline=color, width=2)
        if is_crossed:
            _draw_cross(draw, x + 12, y, color)
        else:
            draw.line([(x + 12, y), (x + 25, y)], fill=color, width=2)

    return draw_symbol


def _block_symbol(color: Color) -> DrawSymbol:
    def draw_symbol(draw: Pen, x: float, y: float) -> None:
        draw.rectangle((x + 3, y - 6, x + 21, y + 6), fill=(*color, 110), outline=color)

    return draw_symbol


def _draw_door_symbol(draw: Pen, x: float, y: float) -> None:
    draw.rectangle((x + 2, y - 2, x + 22, y + 2), fill=(*palette.OBJECT, 150), outline=palette.OBJECT)
    for k in range(3):
        draw.line([(x + 2, y - 2 - 3 * k), (x + 2, y - 3 - 3 * k)], fill=palette.OBJECT)


def _draw_pedestrian_symbol(draw: Pen, x: float, y: float) -> None:
    draw.ellipse((x + 6, y - 6, x + 18, y + 6), fill=(*palette.PEDESTRIAN, 150), outline=palette.PEDESTRIAN)
    draw.line([(x + 12, y), (x + 23, y)], fill=palette.PEDESTRIAN, width=2)


def _hatched_symbol(color: Color, rise: float) -> DrawSymbol:
    """Return a function that draws slanted lines, which rise by 2 * `rise` px to the right, or fall if negative."""

    def draw_symbol(draw: Pen, x: float, y: float) -> None:
        for k in range(3):
            draw.line([(x + 7 * k, y + rise), (x + 7 * k + 9, y - rise)], fill=color, width=1)

    return draw_symbol


def _draw_fault_symbol(draw: Pen, x: float, y: float) -> None:
    draw.line([(x, y), (x + 24, y)], fill=palette.FAULTY, width=10)
    draw.polygon([(x + 13, y - 8), (x + 8, y + 1), (x + 12, y + 1), (x + 11, y + 8), (x + 17, y - 2), (x + 13, y - 2)],
                 fill=palette.AMBER)  # fmt: skip


def _polygon_symbol(offsets: Sequence[tuple[float, float]], color: Color) -> DrawSymbol:
    def draw_symbol(draw: Pen, x: float, y: float) -> None:
        draw.polygon([(x + 12 + dx, y + dy) for dx, dy in offsets], fill=color)

    return draw_symbol


def _draw_time_bar(draw: Pen, scene: Scene, y: float) -> None:
    """Draw the color scale of the true path, from the start to the end of the run, around the row `y`."""
    end = f"{scene.result.simulated:.0f} s"
    left, right = _PADDING_PX + 34, WIDTH_PX - _PADDING_PX - math.ceil(font(12).getlength(end)) - 8
    draw_text(draw, TextItem(_PADDING_PX, y, "0 s", 12, palette.FAINT_INK))
    for x in range(left, right):
        draw.line([(x, y - 4), (x, y + 4)], fill=palette.time_color((x - left) / (right - left)))
    draw_text(draw, TextItem(right + 8, y, end, 12, palette.FAINT_INK))
