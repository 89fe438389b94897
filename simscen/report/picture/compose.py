"""map.png: a run at one glance."""

import math
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from simscen.core.geometry import Array
from simscen.report.picture import ground, marks, palette
from simscen.report.picture.canvas import Bounds, Canvas, Note, font, shown, write
from simscen.report.picture.scene import Scene
from simscen.report.picture.sidebar import WIDTH, sidebar

HEADER = 66
LARGEST = (1000, 800)
"""Pixels that the map may take."""


def draw(scene: Scene) -> Image.Image:
    """The picture: header, map with everything that happened on it, and the criteria beside it."""
    map_ = _map(scene)
    words = sidebar(scene, map_.height)
    image = Image.new("RGB", (map_.width + WIDTH, HEADER + max(map_.height, words.height)), palette.PAGE)
    image.paste(palette.UNKNOWN, (0, HEADER, map_.width, image.height))
    image.paste(map_, (0, HEADER + (image.height - HEADER - map_.height) // 2))
    image.paste(words, (map_.width, HEADER))
    _header(image, scene)
    return image


def write_picture(scene: Scene, path: Path) -> None:
    """Draw and save; PNG with fast compression, which costs 10 % in size and saves two thirds of the time."""
    draw(scene).save(path, format="PNG", compress_level=3)


def _map(scene: Scene) -> Image.Image:
    bounds = ground.extent(scene.map, _shown(scene))
    canvas = Canvas(bounds, _scale(bounds), palette.UNKNOWN)
    ground.lay(canvas, scene.map)
    marks.draw_places(canvas, scene)
    for draw_mark in (marks.draw_plans, marks.draw_goals):
        for robot in scene.each:
            draw_mark(canvas, robot)
    marks.draw_objects(canvas, scene)
    for draw_mark in (marks.draw_truth, marks.draw_belief, marks.draw_robot):
        for robot in scene.each:
            draw_mark(canvas, robot)
    for robot in scene.each:
        marks.draw_marks(canvas, robot)
        marks.draw_collisions(canvas, robot)
    marks.draw_violations(canvas, scene)
    _scale_bar(canvas)
    return canvas.finish()


def _shown(scene: Scene) -> Array:
    """Points that must be on the picture. Where things are parked far away until they are needed is not."""
    goals = [(goal.pose.x, goal.pose.y) for robot in scene.each for goal in robot.case.every_goal]
    ways = [robot.trace.truth.values[:, :2] for robot in scene.each]
    return np.vstack((np.array(goals).reshape(-1, 2), *ways))


def _scale(bounds: Bounds) -> float:
    x0, y0, x1, y1 = bounds
    return min(LARGEST[0] / (x1 - x0), LARGEST[1] / (y1 - y0))


def _scale_bar(canvas: Canvas) -> None:
    most = canvas.width / canvas.scale / 4
    power = 10.0 ** math.floor(math.log10(most))
    metres = max(power * factor for factor in (1, 2, 5) if power * factor <= most)
    x0, y0, _, _ = canvas.bounds
    left, low = x0 + 14 / canvas.scale, y0 + 16 / canvas.scale
    tick = 4 / canvas.scale
    canvas.line(np.array([(left, low), (left + metres, low)]), palette.INK, 2.0)
    for x in (left, left + metres):
        canvas.line(np.array([(x, low - tick), (x, low + tick)]), palette.INK, 2.0)
    u, v = canvas.pixel(left + metres / 2, low)
    canvas.note(Note(u, v - 11, f"{metres:g} m", 12, palette.INK, "mm", halo=palette.UNKNOWN))


def _header(image: Image.Image, scene: Scene) -> None:
    result, pen = scene.result, ImageDraw.Draw(image)
    word, colour = result.outcome.value.replace("-", " ").upper(), palette.OUTCOMES[result.outcome]
    wide = math.ceil(font(16).getlength(word)) + 24
    pen.rounded_rectangle((16, 16, 16 + wide, 46), 6, fill=colour)
    write(pen, Note(16 + wide / 2, 31, word, 16, palette.PAGE, "mm"))
    write(pen, Note(32 + wide, 23, shown(result.key.scenario), 18, palette.INK))
    write(pen, Note(32 + wide, 45, _facts(scene), 13, palette.FAINT_INK))
    pen.line([(0, HEADER - 1), (image.width, HEADER - 1)], fill=palette.RULE)


def _facts(scene: Scene) -> str:
    result = scene.result
    length = result.metrics.get("path_length")
    key = result.key
    facts = [f"seed {key.seed}", key.variation, key.stack_name, f"{result.simulated:.1f} s simulated"]
    facts += [f"{length:.1f} m driven" if length is not None else "", f"ended: {shown(result.ended)}"]
    return "   ·   ".join(fact for fact in facts if fact)
