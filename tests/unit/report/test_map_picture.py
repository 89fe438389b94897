"""Tests of the picture of a run: colors of the path, of walls, and of marks."""

import numpy as np
import pytest
from PIL import Image

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.scenery import MovableObject, Scenery
from simscen.core.geometry import Pose2
from simscen.core.records.run_result import RunKey
from simscen.criteria.registry import AnyCriterion
from simscen.judge.run_result import judge_run
from simscen.report.picture import map_picture, palette
from simscen.report.picture.canvas import Canvas
from simscen.report.picture.map_layer import MARGIN_M, MAX_MAP_SIZE_PX, draw_map, map_extent
from simscen.report.picture.map_picture import (
    _MARGIN_PX,
    HEADER_HEIGHT_PX,
    draw_map_canvas,
    draw_map_picture,
    write_picture,
)
from simscen.report.picture.object_outlines import object_outlines, outlines_of_event
from simscen.report.picture.path_layer import round_time_step
from simscen.report.picture.scene import Scene
from simscen.report.picture.world_layer import draw_objects
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

WIDE, TALL, RESOLUTION = 200, 120, 0.05


def room(yaw=0.0):
    """Return the map of two rooms with a door in the wall between them."""
    cells = np.zeros((TALL, WIDE), dtype=np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    cells[:, 100:104] = 100
    cells[40:60, 100:104] = 0
    return OccupancyGrid(cells, RESOLUTION, Pose2(0.0, 0.0, yaw))


def make_scene(**changes):
    """Return the scene of a drive through a door, with a spawned box and a collision."""
    sketch = {
        "seconds": 10,
        "truth": [[0, 1, 1], [5, 1, 2.5], [10, 8, 2.5]],
        "belief": None,
        "events": [
            [1, "goal.accepted", "end"],
            [
                2,
                "object.spawned",
                "box",
                {"parts": [[[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]], "x": 7, "y": 4.5, "yaw": 0.5},
            ],
            [6, "collision.started", "box", {"x": 3.0, "y": 5.0}],
        ],
        **changes,
    }
    case = synthetic_case(
        {"goals": [{"name": "end", "pose": [8, 4.5, 0]}], "footprint": [[-0.2, -0.2], [0.2, 0], [-0.2, 0.2]]}
    )
    trace = synthetic_trace(sketch)
    criteria = [AnyCriterion.model_validate({"clearance": {"min": 2.0}})]
    result = judge_run(RunKey("room/cross", 3), "room/cross.scenario.yaml", criteria, trace, case)
    return Scene(trace, case, room(), result, Scenery(places={"corner": Pose2(9, 1)}))


def pixel(image, x, y):
    """Return the color of the picture at a point of the world."""
    scale = min(
        MAX_MAP_SIZE_PX[0] / (WIDE * RESOLUTION + 2 * MARGIN_M), MAX_MAP_SIZE_PX[1] / (TALL * RESOLUTION + 2 * MARGIN_M)
    )
    u, v = (
        (x + MARGIN_M) * scale + map_picture.LEFT_MARGIN_PX,
        (TALL * RESOLUTION + MARGIN_M - y) * scale + HEADER_HEIGHT_PX + _MARGIN_PX,
    )
    return image.getpixel((int(u), int(v)))


def is_similar(color, expected, tolerance=30):
    return all(abs(a - b) <= tolerance for a, b in zip(color, expected, strict=True))


def test_free_space_and_walls_are_where_the_map_has_them():
    image = draw_map_picture(make_scene())
    assert is_similar(pixel(image, 5.1, 0.5), palette.WALL)
    assert is_similar(pixel(image, 2.0, 4.0), palette.FREE)
    assert is_similar(pixel(image, -0.2, 3.0), palette.UNKNOWN)


def test_driven_path_leads_through_the_door_and_is_colored_by_time():
    image = draw_map_picture(make_scene())
    early_color, late_color = pixel(image, 1.0, 1.75), pixel(image, 7.0, 2.5)
    assert is_similar(early_color, palette.time_color(0.25), 40)
    assert is_similar(late_color, palette.time_color(0.93), 40)
    assert early_color[2] > late_color[2]


def test_spawned_object_is_drawn_at_the_pose_of_its_event():
    assert not is_similar(pixel(draw_map_picture(make_scene()), 7.3, 4.6), palette.FREE)
    without_object = make_scene(events=[[1, "goal.accepted", "end"]])
    assert is_similar(pixel(draw_map_picture(without_object), 6.8, 4.2), palette.FREE)


def test_object_that_replaces_another_one_is_not_removed():
    """Both events have the same tick. An object that is removed later is marked."""
    shape = {"parts": [[[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]], "x": 7, "y": 4.5, "yaw": 0.0}
    replaced = [[2, "object.spawned", "box", shape], [4, "object.removed", "box"], [4, "object.spawned", "box", shape]]

    def texts(events):
        canvas = Canvas((0.0, 0.0, 10.0, 6.0), 50.0, palette.FREE)
        return [label.text for label in draw_objects(canvas, make_scene(events=events))]

    assert texts(replaced) == ["box"]
    assert texts([*replaced, [6, "object.removed", "box"]]) == ["box (removed at 6.0 s)"]


def test_a_collision_has_a_red_star():
    assert is_similar(pixel(draw_map_picture(make_scene()), 3.0, 5.0), palette.RED)


def test_mark_has_a_flag_at_the_position_of_the_robot():
    with_mark = make_scene(events=[[7.5, "mark", "now"]])
    assert dict(draw_map_canvas(with_mark).parts)["mark now"].tolist() == [pytest.approx([4.5, 2.5])]
    assert is_similar(pixel(draw_map_picture(with_mark), 4.53, 2.66), palette.AMBER)
    assert is_similar(pixel(draw_map_picture(make_scene()), 4.5, 2.5), palette.time_color(0.75), 60), (
        "the path has its time color at this point"
    )


def test_the_verdict_is_on_the_picture_in_its_color():
    image = draw_map_picture(make_scene())
    assert is_similar(image.getpixel((20, 31)), palette.RED)


def test_the_same_run_gives_the_same_picture(tmp_path):
    for name in ("a.png", "b.png"):
        write_picture(make_scene(), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    with Image.open(tmp_path / "a.png") as image:
        assert image.width > image.height > 300


@pytest.mark.parametrize("seconds", [0, 0.025, 1])
def test_picture_of_a_run_of_one_tick(seconds):
    short_scene = make_scene(seconds=seconds, truth=[[0, 1, 1]], ended=None, events=[])
    assert draw_map_picture(short_scene).width > 300


def test_rotated_map_is_drawn_rotated():
    grid = room(yaw=np.pi / 2)
    bounds = map_extent(grid, np.empty((0, 2)))
    assert bounds == pytest.approx((-6.4, -0.4, 0.4, 10.4))
    canvas = Canvas(bounds, 40.0, palette.UNKNOWN)
    draw_map(canvas, grid)
    image = canvas.finish()
    u, v = canvas.pixel(-1.0, 5.1)
    assert is_similar(image.getpixel((int(u), int(v))), palette.WALL)
    u, v = canvas.pixel(-2.5, 5.1)
    assert is_similar(image.getpixel((int(u), int(v))), palette.FREE)


def test_thin_walls_of_a_huge_map_are_not_interrupted():
    cells = np.zeros((2000, 2000), dtype=np.int8)
    cells[:, 1000] = 100
    grid = OccupancyGrid(cells, 0.01)
    canvas = Canvas(map_extent(grid, np.empty((0, 2))), 10.0, palette.UNKNOWN)
    draw_map(canvas, grid)
    image = np.asarray(canvas.finish()).astype(int)
    row = image[100:110, 95:115].sum(axis=2).min(axis=1)
    assert (row < 3 * 200).all()


def test_outline_has_all_parts_and_unknown_shapes_are_discs():
    legs = (((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)), ((2.0, 0.0), (3.0, 0.0), (2.0, 1.0)))
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]], "objects": {"ghost": [[0, 1, 1, 0]]}})
    outlines = object_outlines(trace, [MovableObject("table", Pose2(0, 0), legs)])
    assert [outline[:, 0].max() for outline in outlines["table"]] == [1.0, 3.0]
    assert np.hypot(*outlines["ghost"][0].T) == pytest.approx(np.full(32, 0.2))


INVALID_POLYGONS = [None, "many", [], [3, []], [[0, 0], [1]], ["a"], [[0, 0], [1, 0]], [[0, 0], [1, 0], [0, "b"]],
                    [[0, 0], [1, 0], [0, float("nan")]], [[0, 0], [1, 0], [0, 10**400]]]  # fmt: skip


@pytest.mark.parametrize("polygon", INVALID_POLYGONS)
def test_invalid_polygons_in_events_are_not_drawn(polygon):
    """Installed stacks can report events with any data."""
    events = [
        [1, "floor.changed", "oil", {"outline": polygon, "friction": 0.1}],
        [1, "object.spawned", "odd", {"parts": [polygon], "x": "left"}],
    ]
    parts = dict(draw_map_canvas(make_scene(events=events)).parts)
    assert not any(name.startswith("floor") for name in parts)
    assert np.hypot(*parts["object odd"].T) == pytest.approx(np.full(32, 0.2))


@pytest.mark.parametrize("data", [{}, {"parts": []}, {"parts": "many"}])
def test_event_without_a_shape_is_drawn_as_a_default_shape(data):
    event = synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]], "events": [[0, "object.spawned", "x", data]]}).events[
        0
    ]
    assert len(outlines_of_event(event)[0]) == 32


@pytest.mark.parametrize(
    ("seconds", "step"), [(0, 1), (3, 1), (10, 1), (11, 2), (31, 5), (94, 10), (101, 20), (450, 50)]
)
def test_at_most_ten_time_marks_at_round_seconds(seconds, step):
    assert round_time_step(seconds) == step
