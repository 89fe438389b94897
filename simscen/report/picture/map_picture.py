"""map.png: a run at one glance."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from simscen.core.geometry import Array
from simscen.core.records.events import EventKind
from simscen.core.records.run_result import Outcome
from simscen.report.picture import event_layer, map_layer, palette, path_layer, world_layer
from simscen.report.picture.canvas import LABEL_CELL_PX, Bounds, Canvas, DrawnPart, TextItem, draw_text, font, printable
from simscen.report.picture.labels import Label, place_labels
from simscen.report.picture.scene import Scene
from simscen.report.picture.sidebar import WIDTH, sidebar

HEADER_HEIGHT_PX = 66
MAX_MAP_SIZE_PX = (1000, 800)
"""Pixels that the map may take."""
_MARGIN_PX = 14
"""Pixels above the map and to its right."""

Draw = Callable[[Canvas, Scene], Iterator[Label]]
_GROUND_LAYERS: tuple[Draw, ...] = (world_layer.draw_ground, world_layer.draw_floors)
_OBJECT_LAYERS: tuple[Draw, ...] = (event_layer.draw_places, world_layer.draw_things)
_LAYERS_BELOW_ROBOT: tuple[Draw, ...] = (
    world_layer.draw_zones,
    event_layer.draw_fault_bands,
    path_layer.draw_plans,
    event_layer.draw_goals,
)
_LAYERS_ABOVE_ROBOT: tuple[Draw, ...] = (
    path_layer.draw_truth,
    path_layer.draw_belief,
    path_layer.draw_robot,
    event_layer.draw_faults,
    event_layer.draw_events,
    path_layer.draw_kidnapping,
    event_layer.draw_marks,
    event_layer.draw_collisions,
)


def draw_map_picture(scene: Scene) -> Image.Image:
    """The picture: header, map with everything that happened on it, and the criteria beside it."""
    canvas = _map(scene)
    map_ = canvas.finish()
    wide, high = (
        map_layer.LEFT_MARGIN_PX + map_.width + _MARGIN_PX,
        _MARGIN_PX + map_.height + map_layer.BOTTOM_MARGIN_PX,
    )
    words = sidebar(scene, [part.what for part in canvas.parts], high)
    image = Image.new("RGB", (wide + WIDTH, HEADER_HEIGHT_PX + max(high, words.height)), palette.PAGE)
    left, top = map_layer.LEFT_MARGIN_PX, HEADER_HEIGHT_PX + _MARGIN_PX
    image.paste(map_, (left, top))
    image.paste(words, (wide, HEADER_HEIGHT_PX))
    pen = ImageDraw.Draw(image, "RGBA")
    map_layer.write_coordinates(pen, canvas, left, top)
    _header(image, scene)
    return image


def drawn_parts(scene: Scene) -> list[DrawnPart]:
    """What is on the map, and where in meters of the world."""
    return _map(scene).parts


def write_picture(scene: Scene, path: Path) -> None:
    """Draw and save; PNG with fast compression, which costs 10 % in size and saves two thirds of the time."""
    draw_map_picture(scene).save(path, format="PNG", compress_level=3)


def _map(scene: Scene) -> Canvas:
    bounds = map_layer.map_extent(scene.map, _required_points(scene))
    canvas = Canvas(bounds, _scale(bounds), None)
    map_layer.draw_map(canvas, scene.map)
    map_layer.draw_grid(canvas)
    labels = [label for draw_all in _GROUND_LAYERS for label in draw_all(canvas, scene)]
    labels += [label for draw_one in _LAYERS_BELOW_ROBOT for robot in scene.each for label in draw_one(canvas, robot)]
    labels += [label for draw_all in _OBJECT_LAYERS for label in draw_all(canvas, scene)]
    labels += [label for draw_one in _LAYERS_ABOVE_ROBOT for robot in scene.each for label in draw_one(canvas, robot)]
    labels += event_layer.draw_violations(canvas, scene)
    place_labels(canvas, labels, _walls(canvas, scene))
    return canvas


def _walls(canvas: Canvas, scene: Scene) -> Array:
    """Where the map is not free, as a share of each cell in which labels look for room."""
    rows, columns = canvas.busy.shape
    v, u = np.mgrid[:rows, :columns] * LABEL_CELL_PX + LABEL_CELL_PX / 2
    x, y = canvas.bounds[0] + u / canvas.scale, canvas.bounds[3] - v / canvas.scale
    values = scene.map.values_at(np.column_stack((x.ravel(), y.ravel())))
    taken: Array = (values > 50).reshape(rows, columns).astype(np.float64)
    return taken


def _required_points(scene: Scene) -> Array:
    """Points that must be on the picture. Where things are parked far away until they are needed is not."""
    event_layer = [(goal.pose.x, goal.pose.y) for robot in scene.each for goal in robot.case.every_goal]
    path_layer = [robot.trace.truth.values[:, :2] for robot in scene.each]
    return np.vstack((np.array(event_layer).reshape(-1, 2), *path_layer))


def _scale(bounds: Bounds) -> float:
    x0, y0, x1, y1 = bounds
    return min(MAX_MAP_SIZE_PX[0] / (x1 - x0), MAX_MAP_SIZE_PX[1] / (y1 - y0))


def _header(image: Image.Image, scene: Scene) -> None:
    result, pen = scene.result, ImageDraw.Draw(image)
    word, color = result.outcome.value.replace("-", " ").upper(), palette.OUTCOMES[result.outcome]
    wide = math.ceil(font(16).getlength(word)) + 24
    pen.rounded_rectangle((16, 16, 16 + wide, 46), 6, fill=color)
    draw_text(pen, TextItem(16 + wide / 2, 31, word, 16, palette.PAGE, "mm"))
    draw_text(pen, TextItem(32 + wide, 23, printable(result.key.scenario), 18, palette.INK))
    draw_text(pen, TextItem(32 + wide, 45, _facts(scene), 13, palette.FAINT_INK))
    pen.line([(0, HEADER_HEIGHT_PX - 1), (image.width, HEADER_HEIGHT_PX - 1)], fill=palette.RULE)


def _facts(scene: Scene) -> str:
    result = scene.result
    length = result.metrics.get("path_length")
    key = result.key
    facts = [f"seed {key.seed}", key.variation, key.stack_name, f"{result.simulated:.1f} s simulated"]
    facts += [f"{length:.1f} m driven" if length is not None else "", f"ended: {printable(end_reason(scene))}"]
    return "   ·   ".join(fact for fact in facts if fact)


def end_reason(scene: Scene) -> str:
    """Why the run ended, with Nav2's code where navigation failed: "navigation ended: NO_VALID_PATH (208)"."""
    if scene.result.outcome is Outcome.ERROR and scene.result.error is not None:
        return f"{scene.result.error.kind}: {scene.result.error.message}"
    told = [scene.result.ended]
    for robot in scene.each:
        for event in robot.trace.of_kind(EventKind.NAVIGATION_ENDED)[-1:]:
            how = " ".join(part for part in (event.name, event_layer.error_code_text(event)) if part)
            told += [robot.called(how)] if event.name != "SUCCEEDED" else []
    return ", ".join(part for part in told if part)
