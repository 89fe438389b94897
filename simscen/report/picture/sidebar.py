"""The words beside the map: what the run was, how each criterion came out, and what the signs mean."""

import math
from collections.abc import Callable

from PIL import Image, ImageDraw

from simscen.core.verdict import Status
from simscen.judge.wording import comparison, subject
from simscen.report.picture import palette
from simscen.report.picture.canvas import Note, font, shown, write
from simscen.report.picture.marks import round_step
from simscen.report.picture.palette import Colour
from simscen.report.picture.scene import Scene

WIDTH = 340
_PAD = 18
_LINE = 17
Sample = Callable[[ImageDraw.ImageDraw, float, float], None]


def sidebar(scene: Scene, height: int) -> Image.Image:
    """The sidebar, at least `height` pixels tall."""
    rows, legend = _criteria(scene), _legend(round_step(scene.result.simulated))
    needed = 40 + sum(_LINE * len(lines) + 8 for _, lines in rows) + 14 + 20 * len(legend) + 62
    image = Image.new("RGB", (WIDTH, max(height, needed)), palette.PAGE)
    draw = ImageDraw.Draw(image, "RGBA")
    _criteria_list(draw, rows)
    top = image.height - 20 * len(legend) - 50
    for number, (text, sample) in enumerate(legend):
        y = top + 20 * number
        sample(draw, _PAD, y)
        write(draw, Note(_PAD + 34, y, text, 12, palette.FAINT_INK))
    _time_bar(draw, scene, image.height - 30)
    return image


def _criteria(scene: Scene) -> list[tuple[Colour, list[str]]]:
    rows = []
    for verdict in scene.result.verdicts:
        finding = verdict.tightest
        warned = verdict.severity == "warn" and verdict.status is not Status.PASS
        colour = palette.AMBER if warned else palette.STATUSES[verdict.status]
        if finding is None:
            rows.append((colour, [f"{shown(verdict.id)}: checked nothing"]))
            continue
        told = shown(f"{subject(verdict, finding)}: {comparison(finding)}")
        details = [shown(text) for text in finding.detail[:2]] if verdict.status is not Status.PASS else []
        rows.append((colour, [line for text in (told, *details) for line in _wrapped(text)]))
    return rows


def _criteria_list(draw: ImageDraw.ImageDraw, rows: list[tuple[Colour, list[str]]]) -> None:
    y = 24.0
    write(draw, Note(_PAD, y, "criteria", 12, palette.FAINT_INK))
    y += 22
    for colour, lines in rows:
        _tick_or_cross(draw, _PAD + 5, y, colour)
        for line in lines:
            write(draw, Note(_PAD + 20, y, line, 13, palette.INK))
            y += _LINE
        y += 8


def _tick_or_cross(draw: ImageDraw.ImageDraw, x: float, y: float, colour: Colour) -> None:
    if colour == palette.GREEN:
        draw.line([(x - 5, y), (x - 1, y + 4), (x + 5, y - 5)], fill=colour, width=2)
    else:
        draw.line([(x - 4, y - 4), (x + 4, y + 4)], fill=colour, width=2)
        draw.line([(x - 4, y + 4), (x + 4, y - 4)], fill=colour, width=2)


def _wrapped(text: str, size: int = 13) -> list[str]:
    """The text in lines that fit; at most four."""
    lines, current = [], ""
    for word in text.split(" "):
        longer = f"{current} {word}".strip()
        if current and font(size).getlength(longer) > WIDTH - _PAD - 30:
            lines.append(current)
            current = word
        else:
            current = longer
    lines.append(current)
    return lines if len(lines) <= 4 else [*lines[:3], f"{lines[3]} …"]


def _legend(step: float) -> list[tuple[str, Sample]]:
    return [
        (f"where it truly was, a dot every {step:g} s", _way),
        ("where it thought it was", _dashes),
        ("plans", lambda d, x, y: d.line([(x, y), (x + 24, y)], fill=palette.PLAN, width=4)),
        ("goal, its tolerance and heading", _ring),
        ("robot at the end", _robot),
        ("object at the end; before, in its time's colour", _block),
        ("collision", lambda d, x, y: d.regular_polygon((x + 12, y, 7), 5, fill=palette.RED)),
        ("where a criterion failed", lambda d, x, y: _tick_or_cross(d, x + 12, y, palette.RED)),
    ]


def _way(draw: ImageDraw.ImageDraw, x: float, y: float) -> None:
    for k in range(24):
        draw.line([(x + k, y), (x + k + 1, y)], fill=palette.ramp(k / 24), width=3)
    draw.ellipse((x + 8, y - 4, x + 16, y + 4), fill=palette.PAGE, outline=palette.ramp(0.5), width=2)


def _robot(draw: ImageDraw.ImageDraw, x: float, y: float) -> None:
    draw.rectangle((x + 4, y - 6, x + 20, y + 6), fill=palette.START, outline=palette.ROBOT)
    draw.polygon([(x + 13, y - 3), (x + 18, y), (x + 13, y + 3)], fill=palette.PAGE)


def _dashes(draw: ImageDraw.ImageDraw, x: float, y: float) -> None:
    for k in range(3):
        draw.line([(x + 10 * k, y), (x + 10 * k + 5, y)], fill=palette.BELIEF, width=2)


def _ring(draw: ImageDraw.ImageDraw, x: float, y: float) -> None:
    draw.ellipse((x + 5, y - 7, x + 19, y + 7), fill=(*palette.GOAL, 46), outline=palette.GOAL, width=2)
    draw.line([(x + 12, y), (x + 25, y)], fill=palette.GOAL, width=2)


def _block(draw: ImageDraw.ImageDraw, x: float, y: float) -> None:
    draw.rectangle((x + 3, y - 6, x + 21, y + 6), fill=(*palette.OBJECT, 150), outline=palette.OBJECT)


def _time_bar(draw: ImageDraw.ImageDraw, scene: Scene, y: float) -> None:
    """The colours of the driven way, from the start to the end of the run."""
    end = f"{scene.result.simulated:.0f} s"
    left, right = _PAD + 34, WIDTH - _PAD - math.ceil(font(12).getlength(end)) - 8
    write(draw, Note(_PAD, y, "0 s", 12, palette.FAINT_INK))
    for x in range(left, right):
        draw.line([(x, y - 4), (x, y + 4)], fill=palette.ramp((x - left) / (right - left)))
    write(draw, Note(right + 8, y, end, 12, palette.FAINT_INK))
