"""map.png: a run at one glance."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from simscen.core.geometry import Array
from simscen.core.records.events import EventKind
from simscen.core.records.run_result import Outcome
from simscen.report.picture import goals, grid, ground, happenings, palette, things, ways, zones
from simscen.report.picture.canvas import COARSE, Bounds, Canvas, Note, Part, font, shown, write
from simscen.report.picture.labels import Label, place
from simscen.report.picture.scene import Scene
from simscen.report.picture.sidebar import WIDTH, sidebar

HEADER = 66
LARGEST = (1000, 800)
"""Pixels that the map may take."""
_EDGE = 14
"""Pixels above the map and to its right."""

Draw = Callable[[Canvas, Scene], Iterator[Label]]
_OF_ALL: tuple[Draw, ...] = (zones.draw_ground, zones.draw_floors)
_THINGS: tuple[Draw, ...] = (happenings.draw_places, things.draw_things)
_UNDER: tuple[Draw, ...] = (zones.draw_zones, happenings.draw_faulty, ways.draw_plans, goals.draw_goals)
_OVER: tuple[Draw, ...] = (
    ways.draw_truth,
    ways.draw_belief,
    ways.draw_robot,
    happenings.draw_faults,
    happenings.draw_events,
    ways.draw_carried,
    happenings.draw_marks,
    happenings.draw_collisions,
)


def draw(scene: Scene) -> Image.Image:
    """The picture: header, map with everything that happened on it, and the criteria beside it."""
    canvas = _map(scene)
    map_ = canvas.finish()
    wide, high = grid.LEFT + map_.width + _EDGE, _EDGE + map_.height + grid.BELOW
    words = sidebar(scene, [part.what for part in canvas.parts], high)
    image = Image.new("RGB", (wide + WIDTH, HEADER + max(high, words.height)), palette.PAGE)
    left, top = grid.LEFT, HEADER + _EDGE
    image.paste(map_, (left, top))
    image.paste(words, (wide, HEADER))
    pen = ImageDraw.Draw(image, "RGBA")
    grid.write_coordinates(pen, canvas, left, top)
    _header(image, scene)
    return image


def parts(scene: Scene) -> list[Part]:
    """What is on the map, and where in meters of the world."""
    return _map(scene).parts


def write_picture(scene: Scene, path: Path) -> None:
    """Draw and save; PNG with fast compression, which costs 10 % in size and saves two thirds of the time."""
    draw(scene).save(path, format="PNG", compress_level=3)


def _map(scene: Scene) -> Canvas:
    bounds = ground.extent(scene.map, _shown(scene))
    canvas = Canvas(bounds, _scale(bounds), None)
    ground.lay(canvas, scene.map)
    grid.draw_grid(canvas)
    labels = [label for draw_all in _OF_ALL for label in draw_all(canvas, scene)]
    labels += [label for draw_one in _UNDER for robot in scene.each for label in draw_one(canvas, robot)]
    labels += [label for draw_all in _THINGS for label in draw_all(canvas, scene)]
    labels += [label for draw_one in _OVER for robot in scene.each for label in draw_one(canvas, robot)]
    labels += happenings.draw_violations(canvas, scene)
    place(canvas, labels, _walls(canvas, scene))
    return canvas


def _walls(canvas: Canvas, scene: Scene) -> Array:
    """Where the map is not free, as a share of each cell in which labels look for room."""
    rows, columns = canvas.busy.shape
    v, u = np.mgrid[:rows, :columns] * COARSE + COARSE / 2
    x, y = canvas.bounds[0] + u / canvas.scale, canvas.bounds[3] - v / canvas.scale
    values = scene.map.values_at(np.column_stack((x.ravel(), y.ravel())))
    taken: Array = (values > 50).reshape(rows, columns).astype(np.float64)
    return taken


def _shown(scene: Scene) -> Array:
    """Points that must be on the picture. Where things are parked far away until they are needed is not."""
    goals = [(goal.pose.x, goal.pose.y) for robot in scene.each for goal in robot.case.every_goal]
    ways = [robot.trace.truth.values[:, :2] for robot in scene.each]
    return np.vstack((np.array(goals).reshape(-1, 2), *ways))


def _scale(bounds: Bounds) -> float:
    x0, y0, x1, y1 = bounds
    return min(LARGEST[0] / (x1 - x0), LARGEST[1] / (y1 - y0))


def _header(image: Image.Image, scene: Scene) -> None:
    result, pen = scene.result, ImageDraw.Draw(image)
    word, color = result.outcome.value.replace("-", " ").upper(), palette.OUTCOMES[result.outcome]
    wide = math.ceil(font(16).getlength(word)) + 24
    pen.rounded_rectangle((16, 16, 16 + wide, 46), 6, fill=color)
    write(pen, Note(16 + wide / 2, 31, word, 16, palette.PAGE, "mm"))
    write(pen, Note(32 + wide, 23, shown(result.key.scenario), 18, palette.INK))
    write(pen, Note(32 + wide, 45, _facts(scene), 13, palette.FAINT_INK))
    pen.line([(0, HEADER - 1), (image.width, HEADER - 1)], fill=palette.RULE)


def _facts(scene: Scene) -> str:
    result = scene.result
    length = result.metrics.get("path_length")
    key = result.key
    facts = [f"seed {key.seed}", key.variation, key.stack_name, f"{result.simulated:.1f} s simulated"]
    facts += [f"{length:.1f} m driven" if length is not None else "", f"ended: {shown(ended(scene))}"]
    return "   ·   ".join(fact for fact in facts if fact)


def ended(scene: Scene) -> str:
    """Why the run ended, with Nav2's code where navigation failed: "navigation ended: NO_VALID_PATH (208)"."""
    if scene.result.outcome is Outcome.ERROR and scene.result.error is not None:
        return f"{scene.result.error.kind}: {scene.result.error.message}"
    told = [scene.result.ended]
    for robot in scene.each:
        for event in robot.trace.of_kind(EventKind.NAVIGATION_ENDED)[-1:]:
            how = " ".join(part for part in (event.name, goals.code_of(event)) if part)
            told += [robot.called(how)] if event.name != "SUCCEEDED" else []
    return ", ".join(part for part in told if part)
