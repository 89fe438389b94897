"""Tests of the parts of a picture in world coordinates."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.scenery import DrivableSurface, FilterZone, FrictionRegion, MovableObject, Scenery
from simscen.core.geometry import Pose2
from simscen.core.records.run_result import RunKey
from simscen.core.records.trace import Samples
from simscen.criteria.registry import AnyCriterion
from simscen.judge.run_result import judge_run
from simscen.loading.scenario import load_scenario
from simscen.record.log_header import scenery_from_header
from simscen.record.log_reader import read_log
from simscen.report.picture import map_picture, sidebar
from simscen.report.picture.canvas import LABEL_CELL_PX, Canvas
from simscen.report.picture.map_picture import draw_map_picture
from simscen.report.picture.path_layer import draw_truth
from simscen.report.picture.scene import Scene, scene_with_robots
from simscen.report.picture.world_layer import draw_ground
from simscen.run.log_header import world_scenery as scenery_in
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

GOLDEN = Path(__file__).parent / "everything.parts.txt"
PANEL = ((0.0, -0.05), (1.0, -0.05), (1.0, 0.05), (0.0, 0.05))
DISC = [[0.3 * np.cos(k * np.pi / 16), 0.3 * np.sin(k * np.pi / 16)] for k in range(32)]
SQUARE = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
TRUTH = [[0, 1, 1], [4, 1, 3], [4.02, 7, 1], [10, 9, 1]]


def room():
    cells = np.zeros((60, 100), dtype=np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = cells[:, 50] = 100
    return OccupancyGrid(cells, 0.1)


def full_scene(**changes):
    """Return a scene with a kidnapped robot and each part that a picture can have."""
    sketch = {
        "seconds": 10,
        "truth": TRUTH,
        "belief": [[0, 1, 1], [4, 1, 3], [8, 1, 4.5], [8.1, 8, 1], [10, 9, 1]],
        "plans": [[0, [[1, 1], [1, 5], [2, 5]]]],
        "objects": {"door": [[0, 5, 2, 0], [2, 5, 2, 1.5708]], "anna": [[0, 3, 1, 0], [10, 3, 4, 0]]},
        "events": [
            [0, "goal.accepted", "shelf"],
            [0, "object.spawned", "anna", {"parts": [DISC], "person": True}],
            [1, "object.spawned", "crate", {"parts": [SQUARE], "x": 2, "y": 5.2, "yaw": 0}],
            [1, "event.started", "gate shuts", {"entry": 0}],
            [2, "fault.started", "lidar.off", {"entry": 0}],
            [3, "object.removed", "crate"],
            [3, "zone.switched", "ward", {"filter": "speed", "enabled": True, "speed_limit": 0.2}],
            [3, "floor.changed", "oil", {"outline": [[6, 4], [7, 4], [7, 5]], "friction": 0.1, "until": 5.0}],
            [4, "robot.placed", "", {"x": 7, "y": 1, "yaw": 0}],
            [5, "fault.ended", "lidar.off", {"entry": 0}],
            [5, "goal.failed", "shelf", {"error_code": 208, "error_name": "NO_VALID_PATH"}],
            [5, "goal.accepted", "late"],
            [6, "mark", "now"],
            [7, "collision.started", "crate", {"x": 8.0, "y": 1.2}],
            [10, "goal.reached", "late"],
            [10, "navigation.ended", "FAILED", {"error_code": 208, "error_name": "NO_VALID_PATH"}],
        ],
        **changes,
    }  # fmt: skip
    case = synthetic_case({
        "goals": [{"name": "shelf", "pose": [2, 5, 0]}, {"name": "never", "pose": [9, 5, 0]}],
        "sent": [{"name": "late", "pose": [9, 1, 0]}, {"name": "unsent", "pose": [8, 3, 0]}],
        "footprint": [[-0.2, -0.2], [0.2, 0], [-0.2, 0.2]],
        "regions": {"ward": [[6, 2], [8, 2], [8, 3], [6, 3]]},
    })  # fmt: skip
    trace = synthetic_trace(sketch)
    criteria = [
        AnyCriterion.model_validate(criterion) for criterion in ({"goals_reached": {}}, {"clearance": {"min": 2.0}})
    ]
    result = judge_run(RunKey("room/all", 3), "room/all.scenario.yaml", criteria, trace, case)
    scenery = Scenery(
        places={"dock": Pose2(1, 1)},
        things=(MovableObject("door", Pose2(5, 2), (PANEL,), Pose2(5, 2, np.pi / 2), Pose2(5, 2, 0.0)),),
        ground=(DrivableSurface("ramp", ((7, 4), (9, 4), (9, 5), (7, 5)), 0.1, (0.05, 0.0)),),
        floors=(FrictionRegion("bay", ((0, 0), (1, 0), (1, 1)), 0.4),),
        zones=(
            FilterZone("keepout", "vault", ((2, 2), (4, 2), (4, 3), (2, 3))),
            FilterZone("keepout", cells=MaskBlocks(0.5, Pose2(6, 5), ((0, 0, 2, 1, 100), (3, 0, 1, 1, 50)))),
        ),
    )
    return Scene(trace, case, room(), result, scenery)


def drawn_parts(scene):
    return map_picture.draw_map_canvas(scene).parts


def part_lines(scene):
    """Return a line for each part of a picture: its name, and its points in m."""
    lines = []
    for name, points in drawn_parts(scene):
        rounded = np.round(points, 2) + 0.0
        lines.append(f"{name}: " + " ".join(f"({x:.2f}, {y:.2f})" for x, y in rounded[:8].tolist()))
    return lines


def points_of(scene, prefix):
    """Return the points of each part whose name starts with a prefix."""
    return [points for name, points in drawn_parts(scene) if name.startswith(prefix)]


def test_picture_has_all_parts_at_their_positions():
    assert part_lines(full_scene()) == GOLDEN.read_text(encoding="utf-8").splitlines()


def test_closed_door_is_drawn_from_hinge_to_post():
    (panel,) = points_of(full_scene(), "door door")
    assert (panel[:, 1].min(), panel[:, 1].max()) == pytest.approx((2.0, 3.0))
    assert panel[:, 0].mean() == pytest.approx(5.0, abs=0.001)


def test_kidnapping_is_a_gap_with_marks_on_both_sides():
    scene = full_scene()
    paths = points_of(scene, "path")
    assert [np.round(path, 1).tolist() for path in paths] == [[[1, 1], [1, 3]], [[7, 1], [9, 1]]]
    assert np.round(points_of(scene, "lifted")[0], 1).tolist() == [[1, 3]]
    assert np.round(points_of(scene, "set down")[0], 1).tolist() == [[7, 1]]


def test_height_just_below_one_meter_is_readable():
    ramp = DrivableSurface("ramp", ((7, 4), (9, 4), (9, 5), (7, 5)), 0.996, (0.05, 0.0))
    scene = replace(full_scene(), scenery=Scenery(ground=(ramp,)))
    canvas = map_picture.draw_map_canvas(full_scene())
    assert [label.text for label in draw_ground(canvas, scene)] == ["ramp, 1 m high"]


def test_time_marks_are_drawn_only_while_the_true_pose_is_known(monkeypatch):
    scene, marks = full_scene(truth=[[0, 1, 1], [10, 6, 1]]), []
    monkeypatch.setattr(Canvas, "disc", lambda canvas, x, y, *arguments, **options: marks.append(round(x, 6)))
    canvas = map_picture.draw_map_canvas(scene)
    known = (scene.trace.truth.ticks >= 720) & (scene.trace.truth.ticks <= 1680)
    marks.clear()
    list(draw_truth(canvas, replace(scene, trace=replace(scene.trace, truth=scene.trace.truth.select(known)))))
    assert marks == [2.5, 3.0, 3.5, 4.0, 4.5]


def test_short_teleport_is_a_gap():
    scene = full_scene(truth=[[0, 1, 1], [4, 1, 3], [4.02, 1.1, 3], [10, 3, 3]])
    assert len(points_of(scene, "path")) == 2


def test_jump_of_the_belief_is_not_a_line():
    assert len(points_of(full_scene(), "belief")) == 2


@pytest.mark.parametrize(("goal", "result"), [("shelf", "failed"), ("never", "not tried"), ("late", "reached")])
def test_goal_shows_its_result(goal, result):
    assert [name for name, _ in drawn_parts(full_scene()) if name.startswith(f"goal {goal}")] == [
        f"goal {goal} {result}"
    ]


def test_goal_that_was_never_sent_is_not_drawn():
    assert points_of(full_scene(), "goal unsent") == []


def test_goal_reached_only_by_the_estimate_is_drawn_as_failed():
    events = [[0, "goal.accepted", "shelf"], [9, "goal.reached", "shelf"]]
    assert "goal shelf failed" in {name for name, _ in drawn_parts(full_scene(events=events))}


def goal_parts(events, goals, **case):
    """Return the names of the drawn goals and labels of a run without criteria."""
    trace = synthetic_trace({"seconds": 10, "truth": [[0, 1, 1], [10, 8, 1]], "events": events})
    result = replace(full_scene().result, verdicts=())
    scene = Scene(trace, synthetic_case({"goals": goals, **case}), room(), result)
    return {name for name, _ in drawn_parts(scene) if name.startswith(("goal ", "label "))}


def test_via_pose_without_reports_has_the_result_of_the_next_stop():
    goals = [{"name": "door", "pose": [4, 1], "via": True}, {"name": "shelf", "pose": [8, 1]}]
    events = [[0, "goal.accepted", "shelf"], [9, "goal.reached", "shelf"]]
    assert {"goal door reached", "goal shelf reached"} <= goal_parts(events, goals)


@pytest.mark.parametrize(("expected", "label"), [("NO_VALID_PATH", "failed as expected"), ("GOAL_OCCUPIED", "failed")])
def test_failure_is_as_expected_only_with_the_expected_error_code(expected, label):
    events = [
        [0, "goal.accepted", "shelf"],
        [9, "goal.failed", "shelf", {"error_code": 208, "error_name": "NO_VALID_PATH"}],
    ]
    parts = goal_parts(events, [{"name": "shelf", "pose": [8, 1]}], expected={"shelf": expected})
    assert f"label shelf: {label}, NO_VALID_PATH (208)" in parts


def test_log_without_true_poses_is_drawn():
    scene = full_scene()
    no_samples = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    parts = drawn_parts(replace(scene, trace=replace(scene.trace, truth=no_samples, velocity=no_samples)))
    assert {"belief", "goal shelf failed"} <= {name for name, _ in parts}


@pytest.mark.parametrize("kind", ["floor.changed", "zone.switched", "object.spawned"])
def test_events_without_data_are_tolerated(kind):
    assert points_of(full_scene(events=[[1, kind, "odd", {"x": "far"}]]), "path")


def test_samples_that_are_not_finite_are_outside_of_the_picture():
    scene = full_scene()
    values = scene.trace.truth.values.copy()
    values[5] = np.nan
    truth = Samples(scene.trace.truth.ticks, values)
    assert (
        draw_map_picture(replace(scene, trace=replace(scene.trace, truth=truth))).size == draw_map_picture(scene).size
    )


def test_failure_has_the_error_code_and_name_of_nav2():
    assert map_picture.end_reason(full_scene()) == "navigation ended, FAILED NO_VALID_PATH (208)"
    assert any("shelf: failed, NO_VALID_PATH (208)" in name for name, _ in drawn_parts(full_scene()))


def test_labels_do_not_overlap_paths_robots_goals_or_each_other():
    canvas = map_picture.draw_map_canvas(full_scene())
    blocked, boxes = canvas.blocked_cells, []
    for label in canvas.texts:
        width = map_picture.font(label.size).getlength(label.text)
        left, right = (label.x - width / 2) / LABEL_CELL_PX, (label.x + width / 2) / LABEL_CELL_PX
        top, bottom = (label.y - label.size / 2) / LABEL_CELL_PX, (label.y + label.size / 2) / LABEL_CELL_PX
        blocked_part = blocked[max(0, int(top)) : int(bottom) + 1, max(0, int(left)) : int(right) + 1]
        assert blocked_part.mean() < 0.15, label.text
        assert not any(left < r and a < right and top < b and t < bottom for a, t, r, b in boxes), label.text
        boxes.append((left, top, right, bottom))


def test_reasons_beside_the_map_are_not_truncated():
    text = " ".join(f"reason{k}" for k in range(60)) + " " + "x" * 90
    assert " ".join(sidebar._wrap(text)).replace(" ", "") == text.replace(" ", "")
    scene = full_scene()
    verdicts = tuple(
        replace(v, findings=tuple(replace(f, detail=(text,) * 5) for f in v.findings)) for v in scene.result.verdicts
    )
    long_reasons = replace(scene, result=replace(scene.result, verdicts=verdicts))
    assert draw_map_picture(long_reasons).height > draw_map_picture(scene).height + 400


def test_legend_explains_each_symbol_of_the_map(monkeypatch):
    texts = []
    monkeypatch.setattr(sidebar, "draw_text", lambda draw, item: texts.append(item.text))
    draw_map_picture(full_scene())
    assert {"robot at an event", "robot at a mark", "named place", "collision", "violated criterion"} <= set(texts)


def test_each_of_several_robots_is_drawn_with_its_name():
    scene = full_scene()
    names = {
        name
        for name, _ in drawn_parts(
            scene_with_robots(scene, {"a": (scene.trace, scene.case), "b": (scene.trace, scene.case)})
        )
    }
    assert {"a: path", "b: path", "goal a: late reached", "a: robot at the end", "b: belief"} <= names


DOORS = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
  doors: [{name: gate, points: [[3, 1], [3, 2]], closed: false}, {name: slide, points: [[4, 1], [4, 2]], motion: slide}]
  places: {dock: {x: 5, y: 3}}
map: none
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 1.5, y: 1}}]
events:
  - {name: shut, when: {time: 0 s}, do: {close: {name: gate, duration: 0.5 s}}}
  - {name: opens, when: {time: 0 s}, do: {open: {name: slide, duration: 0.5 s}}}
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""


def test_picture_from_the_log_has_the_same_parts_as_the_picture_of_the_run(tmp_path):
    file = tmp_path / "doors.scenario.yaml"
    file.write_text(DOORS)
    prepared = prepare(load_scenario(file, tmp_path))
    run = simulate(prepared, log=tmp_path / "run.mcap")
    scene = Scene(run.trace, run.case, prepared.built.map, run.result, scenery_in(prepared))
    log = read_log(tmp_path / "run.mcap")
    scenery = scenery_from_header(log.header)
    assert scenery.map is not None
    scene_from_log = Scene(log.trace, log.header.case, scenery.map.grid, run.result, scenery)
    assert part_lines(scene_from_log) == part_lines(scene)
    (gate,), (slide,) = points_of(scene_from_log, "door gate"), points_of(scene_from_log, "door slide")
    assert (gate[:, 1].min(), gate[:, 1].max()) == pytest.approx((1.0, 2.0))
    assert (slide[:, 1].min(), slide[:, 1].max()) == pytest.approx((0.0, 1.0))
