"""Picture of a run, map.png: header, map with paths and events, and sidebar."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from simscen.core.geometry import Array
from simscen.core.records.events import EventKind
from simscen.core.records.run_result import Outcome
from simscen.report.picture import event_layer, palette, path_layer, world_layer
from simscen.report.picture.canvas import LABEL_CELL_PX, Canvas, TextItem, draw_text, font, printable
from simscen.report.picture.labels import Label, place_labels
from simscen.report.picture.map_layer import (
    BOTTOM_MARGIN_PX,
    LEFT_MARGIN_PX,
    draw_grid,
    draw_map,
    grid_spacing,
    map_extent,
    map_scale,
    write_coordinates,
)
from simscen.report.picture.scene import Scene
from simscen.report.picture.sidebar import WIDTH_PX, draw_sidebar

HEADER_HEIGHT_PX = 66
_MARGIN_PX = 14
"""Margin above the map and to the right of the map."""

DrawLayer = Callable[[Canvas, Scene], Iterator[Label]]
"""Function that draws one layer on the canvas, and yields its labels."""
_GROUND_LAYERS: tuple[DrawLayer, ...] = (world_layer.draw_ground, world_layer.draw_floors)
_LAYERS_BELOW_ROBOT: tuple[DrawLayer, ...] = (
    world_layer.draw_zones,
    event_layer.draw_fault_bands,
    path_layer.draw_plans,
    event_layer.draw_goals,
)
_OBJECT_LAYERS: tuple[DrawLayer, ...] = (event_layer.draw_places, world_layer.draw_objects)
_LAYERS_ABOVE_ROBOT: tuple[DrawLayer, ...] = (
    path_layer.draw_truth,
    path_layer.draw_belief,
    path_layer.draw_robot,
    event_layer.draw_faults,
    event_layer.draw_events,
    path_layer.draw_kidnapping,
    event_layer.draw_marks,
    event_layer.draw_collisions,
)
"""Layers in drawing order: ground, below the robot, objects, above the robot. Robot layers are drawn for each robot."""


def draw_map_picture(scene: Scene) -> Image.Image:
    """Draw the picture of a run: header, map with events, and sidebar with criteria and legend."""
    canvas = draw_map_canvas(scene)
    map_image = canvas.finish()
    width = LEFT_MARGIN_PX + map_image.width + _MARGIN_PX
    height = _MARGIN_PX + map_image.height + BOTTOM_MARGIN_PX
    sidebar = draw_sidebar(scene, [part.name for part in canvas.parts], height)
    image = Image.new("RGB", (width + WIDTH_PX, HEADER_HEIGHT_PX + max(height, sidebar.height)), palette.PAGE)
    left, top = LEFT_MARGIN_PX, HEADER_HEIGHT_PX + _MARGIN_PX
    image.paste(map_image, (left, top))
    image.paste(sidebar, (width, HEADER_HEIGHT_PX))
    pen = ImageDraw.Draw(image, "RGBA")
    write_coordinates(pen, canvas, left, top)
    _draw_header(image, scene)
    return image


def write_picture(scene: Scene, path: Path) -> None:
    """Draw the picture and save it as PNG at `path`."""
    # A low compression level saves two thirds of the time, and the files are only slightly larger.
    draw_map_picture(scene).save(path, format="PNG", compress_level=3)


def draw_map_canvas(scene: Scene) -> Canvas:
    """Draw the map with all layers and labels, without header and sidebar."""
    # The picture shows all goals and true paths, even outside of the map.
    goals = [(goal.pose.x, goal.pose.y) for robot in scene.per_robot for goal in robot.case.every_goal]
    paths = [robot.trace.truth.values[:, :2] for robot in scene.per_robot]
    bounds = map_extent(scene.map, np.vstack((np.array(goals).reshape(-1, 2), *paths)))
    canvas = Canvas(bounds, map_scale(bounds), None)
    draw_map(canvas, scene.map)
    draw_grid(canvas, grid_spacing(canvas), palette.GRID)
    labels = [label for draw in _GROUND_LAYERS for label in draw(canvas, scene)]
    labels += [label for draw in _LAYERS_BELOW_ROBOT for robot in scene.per_robot for label in draw(canvas, robot)]
    labels += [label for draw in _OBJECT_LAYERS for label in draw(canvas, scene)]
    labels += [
        label
        for draw in _LAYERS_ABOVE_ROBOT
        for robot in scene.per_robot
        if len(robot.trace.truth) or draw is path_layer.draw_belief  # the other layers need the true pose
        for label in draw(canvas, robot)
    ]
    labels += event_layer.draw_violations(canvas, scene)
    place_labels(canvas, labels, _wall_cells(canvas, scene))
    return canvas


def _wall_cells(canvas: Canvas, scene: Scene) -> Array:
    """Return 1.0 for each label cell whose center is occupied on the map, and 0.0 for the others."""
    rows, columns = canvas.blocked_cells.shape
    v, u = np.mgrid[:rows, :columns] * LABEL_CELL_PX + LABEL_CELL_PX / 2
    x, y = canvas.bounds[0] + u / canvas.scale, canvas.bounds[3] - v / canvas.scale
    values = scene.map.values_at(np.column_stack((x.ravel(), y.ravel())))
    occupied: Array = (values > 50).reshape(rows, columns).astype(np.float64)
    return occupied


def _draw_header(image: Image.Image, scene: Scene) -> None:
    """Draw the outcome, the name of the scenario, and the line of `_facts_text` at the top of the picture."""
    result, pen = scene.result, ImageDraw.Draw(image)
    word, color = result.outcome.value.replace("-", " ").upper(), palette.OUTCOME_COLORS[result.outcome]
    width = math.ceil(font(16).getlength(word)) + 24
    pen.rounded_rectangle((16, 16, 16 + width, 46), 6, fill=color)
    draw_text(pen, TextItem(16 + width / 2, 31, word, 16, palette.PAGE, "mm"))
    draw_text(pen, TextItem(32 + width, 23, printable(result.key.scenario), 18, palette.INK))
    draw_text(pen, TextItem(32 + width, 45, _facts_text(scene), 13, palette.FAINT_INK))
    pen.line([(0, HEADER_HEIGHT_PX - 1), (image.width, HEADER_HEIGHT_PX - 1)], fill=palette.RULE)


def _facts_text(scene: Scene) -> str:
    """Return the seed, variation, stack, simulated time, driven distance, and reason for the end in one line."""
    result = scene.result
    length = result.metrics.get("path_length")
    key = result.key
    facts = [f"seed {key.seed}", key.variation, key.stack_name, f"{result.simulated:.1f} s simulated"]
    facts += [f"{length:.1f} m driven" if length is not None else "", f"ended: {printable(end_reason(scene))}"]
    return "   ·   ".join(fact for fact in facts if fact)


def end_reason(scene: Scene) -> str:
    """Return the error of the run; without an error, why the run ended, and the result of each failed navigation."""
    if scene.result.outcome is Outcome.ERROR and scene.result.error is not None:
        return f"{scene.result.error.kind}: {scene.result.error.message}"
    reasons = [scene.result.ended]
    for robot in scene.per_robot:
        for event in robot.trace.of_kind(EventKind.NAVIGATION_ENDED)[-1:]:
            text = " ".join(part for part in (event.name, event_layer.error_code_text(event)) if part)
            reasons += [robot.label(text)] if event.name != "SUCCEEDED" else []
    return ", ".join(reason for reason in reasons if reason)
