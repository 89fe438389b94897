"""Tests of the topics with objects and zones, and of the frames of several robots."""

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from moments import CLOCK, moments, sample_header

from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.environment.scenery import DrivableSurface, FilterZone, MovableObject, Scenery
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision, Moment
from simscen.record.log_header import SCENERY_FILE, scenery_to_json
from simscen.record.log_reader import read_log
from simscen.record.recorder import Recorder

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
SCENERY = Scenery(
    places={"dock": Pose2(4.0, 2.0, 0.0)},
    things=(MovableObject("gate", Pose2(0.0, 0.0, 0.0), (SQUARE,), Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 1.5)),),
    ground=(DrivableSurface("ramp", SQUARE, 0.25),),
    zones=(
        FilterZone("speed", "ward", SQUARE, 0.25),
        FilterZone("keepout", cells=MaskBlocks(0.5, Pose2(1.0, 1.0, 0.0), ((0, 0, 4, 2, 100),))),
        FilterZone("keepout", "of another", SQUARE, robot="other"),
    ),
)


def markers_on(topic: str, *beats: tuple[int, list[Event]]) -> list[tuple[float, list[Any]]]:
    """Return the times (s) and markers of all messages on a topic."""
    stream = io.BytesIO()
    files = {SCENERY_FILE: scenery_to_json(SCENERY)}
    recorder = Recorder(stream, CLOCK, replace(sample_header(), files=files))
    for tick, events in beats:
        recorder.append(Moment(tick, None, (), Decision(STOP), tuple(events)))
    recorder.close(480, "{}")
    stream.seek(0)
    reader = make_reader(stream, decoder_factories=[DecoderFactory()])
    return [(m.log_time / 1e9, message.markers) for _, _, m, message in reader.iter_decoded_messages([topic])]


def spawned(name: str, parts: Any, **details: Any) -> Event:
    return Event(0, EventKind.OBJECT_SPAWNED, name, {"parts": parts, **details})


def log_of_two_robots(folder: Path) -> Path:
    """Write a log of two robots, one of which is named like the frame prefix of objects."""
    path = folder / "run.mcap"
    recorder = Recorder(path, CLOCK, replace(sample_header(), robots={"a": sample_header(), "object": sample_header()}))
    for moment in moments(1.0):
        for robot in recorder.robots.values():
            robot.append(moment)
    recorder.close(240, "{}")
    return path


def groups(markers: list[Any]) -> set[tuple[str, str]]:
    """Return namespace and text of the markers after the first, which deletes the previous markers."""
    return {(marker.ns, marker.text) for marker in markers[1:]}


def test_objects_are_published_again_when_one_appears_or_disappears() -> None:
    square = [list(corner) for corner in SQUARE]
    first_events = [spawned("gate", [square]), spawned("anna", [square], person=True)]
    mark = Event(0, EventKind.MARK, "box")
    box, removed = spawned("box", [square, square[:3]]), Event(0, EventKind.OBJECT_REMOVED, "anna")
    updates = markers_on("/simscen/things", (0, first_events), (24, []), (240, [box]), (480, [removed, mark]))
    assert [time for time, _ in updates] == [0.0, 1.0, 2.0]
    assert [{marker.header.frame_id for marker in markers[1:]} for _, markers in updates] == [
        {"object/gate", "object/anna"},
        {"object/gate", "object/anna", "object/box"},
        {"object/gate", "object/box"},
    ]
    assert all(
        markers[0].action == 3 and all(m.action == 0 and m.frame_locked for m in markers[1:]) for _, markers in updates
    )
    assert {ns for ns, _ in groups(updates[1][1])} == {"doors", "people", "things", "names"}
    (outline,) = (marker for marker in updates[-1][1] if marker.ns == "things")
    assert len(outline.points) == 2 * (4 + 3)
    assert (outline.points[1].x, outline.points[1].y) == (1.0, 0.0)


@pytest.mark.parametrize("parts", [None, "round", [3, []], [[["x", "y"]] * 3], [[[1.0, 2.0]]]])
def test_object_with_an_invalid_outline_shows_only_its_name(parts: Any) -> None:
    ((_, markers),) = markers_on("/simscen/things", (0, [spawned("odd", parts)]))
    assert [(marker.ns, len(marker.points)) for marker in markers[1:]] == [("names", 0)]


def test_zones_are_published_again_when_one_is_switched() -> None:
    def switch(region: str, kind: str, enabled: bool, **data: float) -> Event:
        return Event(0, EventKind.ZONE_SWITCHED, region, {"filter": kind, "enabled": enabled, **data})

    updates = markers_on(
        "/simscen/scene",
        (0, []),
        (240, [switch("ward", "speed", False), switch("aisle", "keepout", True)]),
        (480, [switch("ward", "speed", True, speed_limit=0.5)]),
    )
    assert [time for time, _ in updates] == [0.0, 1.0, 2.0]
    first, second, third = (groups(markers) for _, markers in updates)
    assert first == {
        ("footprint", ""), ("believed footprint", ""), ("ramps", ""), ("places", ""), ("places", "dock"),
        ("speed zones", ""), ("speed zones", "ward: 0.25 m/s"), ("keepout zones", ""),
    }  # fmt: skip
    speed = {("speed zones", ""), ("speed zones", "ward: 0.25 m/s")}
    assert second == first - speed | {("keepout zones", "aisle")}
    assert third - second == {("speed zones", ""), ("speed zones", "ward: 0.5 m/s")}


def test_mask_is_drawn_as_triangles_over_its_cells() -> None:
    ((_, markers),) = markers_on("/simscen/scene", (0, []))
    (mask,) = (marker for marker in markers if marker.type == 11)
    assert (mask.pose.position.x, mask.pose.position.y) == (1.0, 1.0)
    assert {(point.x, point.y) for point in mask.points} == {(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)}
    assert len(mask.points) == 6


def test_frames_of_several_robots_are_in_one_tree(tmp_path: Path) -> None:
    stream = io.BytesIO(log_of_two_robots(tmp_path).read_bytes())
    parents = {}
    reader = make_reader(stream, decoder_factories=[DecoderFactory()])
    for _, _, _, message in reader.iter_decoded_messages(["/a/tf", "/a/tf_static", "/object/tf", "/object/tf_static"]):
        parents |= {link.child_frame_id: link.header.frame_id for link in message.transforms}
    for prefix in ("a/", "object_/"):
        assert parents[f"{prefix}odom"] == parents[f"{prefix}base_link_truth"] == "map"
        assert parents[f"{prefix}lidar"] == parents[f"{prefix}camera"] == f"{prefix}base_link"


def test_mounts_and_scans_of_several_robots_are_read_without_their_prefix(tmp_path: Path) -> None:
    for log in read_log(log_of_two_robots(tmp_path), with_sensors=True).robots.values():
        assert set(log.header.mounts) == {"camera", "lidar", "rear lidar"}
        assert set(log.trace.objects) == {"cart", "a box"}
        _, scan = log.sensors.scans["/scan"][0]
        assert log.sensors.decode_scan(scan).mount == Pose2(0.1, 0.0, 0.0)
