"""Tests of logs and layouts with the readers of Foxglove and Lichtblick."""

import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simscen.core.records.events import EventKind
from simscen.loading.scenario import load_scenario
from simscen.record.log_reader import Log, read_run
from simscen.report.viewer_layouts import foxglove_layout, rviz_config
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

SCENARIO = """\
simscen: 1
time_limit: 6 s
world:
  simscen: 1
  walls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}]
  doors: [{name: gate, points: [[6, 0], [6, 1]]}]
  objects: [{name: crate, pose: {x: 5, y: 5}, box: [0.4, 0.6, 0.5]}]
  regions: {corner: [[0, 4], [2, 4], [2, 6], [0, 6]]}
  places: {desk: {x: 4, y: 2}}
"""
ONE = """\
robot: {pose: {x: 1, y: 1}}
stack: {keepout: [corner]}
goals: [desk]
events:
  - {when: {time: 0 s}, do: {pedestrian: {name: walker, pose: {x: 2.5, y: 5}, goals: [[5, 5.5]]}}}
  - {when: {time: 1 s}, do: {spawn: {name: late, pose: {x: 1, y: 3.3}, cylinder: [0.2, 1.0]}}}
  - {when: {time: 2 s}, do: {move: {name: crate, through: [[5, 4]], speed: 0.5 m/s}}}
  - {when: {time: 3 s}, do: {remove: {name: late}}}
pass: [{collisions: {max: 0}}]
"""
SEVERAL = """\
robots:
  object: {pose: {x: 1, y: 1}, goals: [desk], pass: [{collisions: {max: 0}}]}
  b: {pose: {x: 2, y: 5}, goals: [{pose: {x: 3, y: 5}}], pass: [{collisions: {max: 0}}]}
"""
ReadInViewer = Callable[[Path], dict[str, Any]]


@pytest.fixture(scope="module", params=["one", "several"])
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp(request.param)
    file, log = home / "viewed.scenario.yaml", home / "run.mcap"
    file.write_text(SCENARIO + (ONE if request.param == "one" else SEVERAL))
    simulate(prepare(load_scenario(file, home)), log=log)
    return log


def test_viewer_reads_all_messages_and_shows_correct_poses(log: Path, read_in_viewer: ReadInViewer) -> None:
    seen, read = read_in_viewer(log), read_run(log)
    assert all(topic["count"] for topic in seen["topics"].values())
    assert set(_topics_of(json.loads(foxglove_layout(read)))) <= set(seen["topics"])
    check_frame_tree(seen["links"])
    for name, robot in (read.robots or {"": read}).items():
        base = {"": "base_link", "object": "object_/base_link"}.get(name, f"{name}/base_link")
        footprint = {"footprint": f"{base}_truth", "believed footprint": base}
        scene = [array for array in seen["arrays"] if array["topic"] == _within(name, "/simscen/scene")]
        assert footprint.items() <= {m["ns"]: m["frame"] for m in scene[-1]["markers"]}.items()
        check_poses_of_frame(seen["links"], robot, f"{base}_truth", robot.trace.truth)
        objects = [array for array in seen["arrays"] if array["topic"] == _within(name, "/simscen/things")]
        check_outlines(objects, robot)
        for object_name, samples in robot.trace.objects.items():
            check_poses_of_frame(seen["links"], robot, f"object/{object_name}", samples)


def test_objects_appear_and_disappear_at_their_times(log: Path, read_in_viewer: ReadInViewer) -> None:
    seen = read_in_viewer(log)
    if log.parent.name.startswith("several"):
        assert {link["child"] for link in seen["links"]} >= {"b/base_link", "object_/base_link", "object/b"}
        return
    shown = [(array["time"] / 1e9, groups(array)) for array in seen["arrays"] if array["topic"] == "/simscen/things"]
    assert [sorted({**now}) for _, now in shown] == [
        ["crate", "gate", "walker"], ["crate", "gate", "late", "walker"], ["crate", "gate", "walker"]
    ]  # fmt: skip
    assert shown[0][1] == {"crate": "things", "gate": "doors", "walker": "people"}
    assert [round(time, 1) for time, _ in shown] == [0.0, 1.0, 3.0]
    (scene,) = [array for array in seen["arrays"] if array["topic"] == "/simscen/scene"]
    assert {"corner", "desk"} <= {marker["text"] for marker in scene["markers"]}
    assert {"keepout zones", "places", "footprint"} <= {marker["ns"] for marker in scene["markers"]}
    assert all(array["count"] <= 200 for array in seen["poses"])


def test_default_layout_is_that_of_a_log_with_one_lidar(log: Path) -> None:
    if log.parent.name.startswith("one"):
        assert foxglove_layout() == foxglove_layout(read_run(log, with_sensors=True))


def test_rviz_config_has_the_topics_of_the_layout(log: Path) -> None:
    shown = {f"/{name}" for name in re.findall(r"^        Value: (\w[\w/]*)$", rviz_config(), re.MULTILINE)}
    layout = json.loads(foxglove_layout())
    assert shown - {"/false"} == {
        *layout["configById"]["3D!scene"]["topics"],
        "/robot_description",
        "/ground_truth/odom",
    }


def _within(robot: str, topic: str) -> str:
    return f"/{robot}{topic}" if robot else topic


def _topics_of(layout: Any) -> Iterator[str]:
    """Yield all topics in a layout."""
    for panel in layout["configById"].values():
        yield from panel.get("topics", {})
        yield from (layer["topic"] for layer in panel.get("layers", {}).values() if "topic" in layer)
        yield from (path["value"].partition(".")[0] for path in panel.get("paths", []))
        yield from (panel[key] for key in ("topicToRender", "topicPath") if key in panel)


def check_frame_tree(links: list[dict[str, Any]]) -> None:
    """Check that each frame has one parent, and that the map is the only root."""
    parents: dict[str, str] = {}
    for link in links:
        assert parents.setdefault(link["child"], link["frame"]) == link["frame"]
    assert {frame for frame in parents.values() if frame not in parents} == {"map"}


def check_poses_of_frame(links: list[dict[str, Any]], log: Log, frame: str, samples: Any) -> None:
    """Check that the pose of a frame is that of the trace, within a millimeter."""
    poses = {link["time"]: link["pose"] for link in links if link["child"] == frame and link["frame"] == "map"}
    assert len(samples)
    for tick, (x, y, yaw) in zip(samples.ticks.tolist(), samples.values.tolist(), strict=True):
        pose = poses[tick * 10**9 // log.trace.tick_rate]
        assert math.hypot(pose[0] - x, pose[1] - y) < 1e-3
        assert abs(math.remainder(2 * math.atan2(pose[5], pose[6]) - yaw, 2 * math.pi)) < 1e-2


def check_outlines(objects: list[dict[str, Any]], log: Log) -> None:
    """Check that each object has its outline, locked to its own frame, and that older markers are deleted."""
    spawned = {event.name: event for event in log.trace.of_kind(EventKind.OBJECT_SPAWNED)}
    for array in objects:
        assert (array["markers"][0]["action"], {m["action"] for m in array["markers"][1:]}) == (3, {0})
        for marker in array["markers"][1:]:
            assert marker["locked"] and marker["pose"][3:] == [0, 0, 0, 1] and marker["opacity"] == 1
            if marker["text"]:
                continue
            parts: Any = spawned[marker["frame"].removeprefix("object/")].data["parts"]
            corners = np.array([corner for part in parts for corner in part])
            points = np.array(marker["points"])[::2, :2]
            assert points.shape == corners.shape
            assert np.abs(points - corners).max() < 1e-3


def groups(array: dict[str, Any]) -> dict[str, str]:
    """Return the marker namespace of each object."""
    shapes = [marker for marker in array["markers"][1:] if not marker["text"]]
    return {marker["frame"].removeprefix("object/"): marker["ns"] for marker in shapes}
