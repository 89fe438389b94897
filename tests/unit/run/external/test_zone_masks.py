"""Tests of the masks with zones that external stacks receive."""

from pathlib import Path

import numpy as np
import pytest

from simscen.core.environment.costmap_filters import FilterMasks, SpeedLimits, Zones
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.records.events import EventKind
from simscen.run.external.protocol import KEEPOUT_ZONES, SPEED_ZONES
from simscen.run.external.zone_masks import ZoneMasks
from simscen.stack.protocols import RobotModel, Surroundings

WORLD = (
    "{simscen: 1, walls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}], "
    "regions: {near: [[4, 0], [5, 0], [5, 6], [4, 6]], far: [[6, 0], [7, 0], [7, 6], [6, 6]]}}"
)
PRINT_MASKS = """\
for step in peer:
    for m in step.messages:
        grid = m.content
        where = lambda x: grid.data[int((3.0 - grid.origin.y) / grid.resolution) * grid.width
                                    + int((x - grid.origin.x) / grid.resolution)]
        print(m.topic, step.tick / 240, where(4.5), where(6.5), flush=True)
    step.drive(0.0, 0.0)
"""
ROBOT = RobotModel(((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)), 0.2, 0.5, 0.2, 0.0, 1.0, 1.0, 1.0, 1.0)
SQUARE = ((1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0))
EAST = ((2.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 4.0))
NO_ZONES = Zones()


def surroundings(**changes) -> Surroundings:
    """Return a robot on an empty map of 4 m by 4 m, with cells of 1 m."""
    grid = OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 1.0)
    return Surroundings(**{"robot": ROBOT, "map": grid, "tick_rate": 240, **changes})


def changed_masks(
    robot_surroundings: Surroundings, zones: Zones, event_zones: Zones = NO_ZONES
) -> dict[str, list[list[int]]]:
    """Return the masks by topic, as rows of cells from the lowest y upward."""
    return {
        topic.name: grid.cells.tolist()
        for topic, grid in ZoneMasks(robot_surroundings, event_zones).changed_masks(zones)
    }


def test_mask_is_sent_again_when_an_event_enables_a_zone(play, tmp_path: Path) -> None:
    events = "[{name: x, when: {time: 0.5}, do: {keepout: {region: far}}}]"
    topics = ["/keepout_zones"]
    stack = "{external: mine, keepout: [near]}"
    run = play(f'peer = Peer("mine", topics={topics})\n' + PRINT_MASKS, world=WORLD, stack=stack, events=events)
    printed = [line.split() for line in (tmp_path / "stack.log").read_text().splitlines()]
    assert [line[2:] for line in printed] == [["100", "0"], ["100", "100"]]
    assert [float(line[1]) for line in printed] == pytest.approx([0.0, 0.5], abs=0.051)
    assert [event.name for event in run.trace.of_kind(EventKind.ZONE_SWITCHED)] == ["far"]


def test_speed_mask_is_sent_again_when_events_switch_its_zones(play, tmp_path: Path) -> None:
    events = (
        "[{name: x, when: {time: 0.2}, do: {speed_zone: {region: far, speed_limit: 0.1}}}, "
        "{name: y, when: {time: 0.4}, do: {speed_zone: {region: near, enabled: false}}}]"
    )
    stack = "{external: mine, speed_zones: [{region: near, speed_limit: 0.2}]}"
    play('peer = Peer("mine", topics=["/speed_zones"])\n' + PRINT_MASKS, world=WORLD, stack=stack, events=events)
    printed = [line.split()[2:] for line in (tmp_path / "stack.log").read_text().splitlines()]
    assert printed == [["20", "0"], ["20", "10"], ["0", "10"]]


@pytest.mark.parametrize(("topic", "happened"), [("/odom", [False, False]), ("/keepout_zones", [True, False])])
def test_stack_switches_only_the_zones_whose_topic_it_receives(play, topic: str, happened: list[bool]) -> None:
    events = (
        "[{name: x, when: {time: 0.5}, required: false, "
        "do: [{keepout: {region: far}}, {speed_zone: {region: near, speed_limit: 0.1}}]}]"
    )
    run = play(
        f'peer = Peer("mine", topics=["{topic}"])\nfor step in peer: step.drive(0.0, 0.0)\n',
        world=WORLD,
        events=events,
    )
    (ended,) = run.trace.of_kind(EventKind.EVENT_ENDED)
    assert [effect["happened"] for effect in ended.data["effects"]] == happened


def test_scenario_without_zones_has_no_masks() -> None:
    assert changed_masks(surroundings(), NO_ZONES) == {}


def test_keepout_polygon_covers_the_cells_whose_center_is_inside() -> None:
    robot_surroundings = surroundings(keepout=(SQUARE,))
    rows = [[0, 0, 0, 0], [0, 100, 100, 0], [0, 100, 100, 0], [0, 0, 0, 0]]
    assert changed_masks(robot_surroundings, Zones((SQUARE,))) == {KEEPOUT_ZONES.name: rows}
    assert changed_masks(robot_surroundings, NO_ZONES) == {KEEPOUT_ZONES.name: [[0] * 4] * 4}


def test_mask_file_and_polygon_are_combined() -> None:
    file = OccupancyGrid(np.array([[100, 0]], dtype=np.int8), 2.0, Pose2(0.0, 0.0, 0.0))
    masks = FilterMasks(file)
    found = changed_masks(surroundings(keepout=(SQUARE,), masks=masks), Zones((SQUARE,), (), masks))[KEEPOUT_ZONES.name]
    assert found == [[100, 100, 0, 0], [100, 100, 100, 0], [0, 100, 100, 0], [0, 0, 0, 0]]


def test_mask_file_alone_is_sent_unchanged_until_it_is_switched_off() -> None:
    file = OccupancyGrid(np.array([[100, -1, 30]], dtype=np.int8), 2.0)
    masks = FilterMasks(file)
    robot_surroundings = surroundings(masks=masks)
    assert changed_masks(robot_surroundings, Zones((), (), masks)) == {KEEPOUT_ZONES.name: [[100, -1, 30]]}
    assert changed_masks(robot_surroundings, NO_ZONES) == {KEEPOUT_ZONES.name: [[0, 0, 0]]}


def test_slower_of_two_limits_counts() -> None:
    zones = Zones((), ((SQUARE, 0.3), (EAST, 0.257)))
    found = changed_masks(surroundings(speed_zones=zones.speed), zones)[SPEED_ZONES.name]
    assert found == [[0, 0, 25, 25], [0, 30, 25, 25], [0, 30, 25, 25], [0, 0, 25, 25]]


def test_limits_in_percent_keep_the_scale_of_the_mask_file() -> None:
    """The limit of the file is (100 - value) percent of 0.5 m/s: 0.25 m/s."""
    limits = SpeedLimits(OccupancyGrid(np.full((2, 2), 50, dtype=np.int8), 1.0), True, 100.0, -1.0)
    zones = Zones((), ((SQUARE, 0.1),), FilterMasks(None, limits))
    robot_surroundings = surroundings(speed_zones=zones.speed, masks=zones.masks)
    assert changed_masks(robot_surroundings, zones)[SPEED_ZONES.name] == [
        [50, 50, 0, 0],
        [50, 80, 80, 0],
        [0, 80, 80, 0],
        [0, 0, 0, 0],
    ]
    assert ZoneMasks(robot_surroundings, NO_ZONES).meanings == [
        {"topic": "/speed_zones", "filter": "speed", "percent": True, "base": 100.0, "multiplier": -1.0}
    ]


def test_mask_file_with_a_constant_limit_is_combined_with_zones() -> None:
    """The limit of the file is 50 percent of 0.5 m/s, for any value."""
    limits = SpeedLimits(OccupancyGrid(np.full((2, 2), 7, dtype=np.int8), 1.0), True, 50.0, 0.0)
    zones = Zones((), ((SQUARE, 0.1),), FilterMasks(None, limits))
    robot_surroundings = surroundings(speed_zones=zones.speed, masks=zones.masks)
    assert changed_masks(robot_surroundings, zones)[SPEED_ZONES.name] == [
        [25, 25, 0, 0],
        [25, 10, 10, 0],
        [0, 10, 10, 0],
        [0, 0, 0, 0],
    ]
    assert ZoneMasks(robot_surroundings, NO_ZONES).meanings[0]["multiplier"] == pytest.approx(0.01)


def test_fast_limits_get_a_coarser_scale() -> None:
    zones = Zones((), ((SQUARE, 2.0),))
    robot_surroundings = surroundings(speed_zones=zones.speed)
    assert max(map(max, changed_masks(robot_surroundings, zones)[SPEED_ZONES.name])) == 100
    assert ZoneMasks(robot_surroundings, NO_ZONES).meanings[0]["multiplier"] == pytest.approx(0.02)


def test_masks_without_a_map_cover_all_zones() -> None:
    robot_surroundings = surroundings(map=None, keepout=(SQUARE,))
    found = changed_masks(robot_surroundings, Zones((SQUARE,)), Zones((EAST,)))[KEEPOUT_ZONES.name]
    assert (len(found), len(found[0])) == (80, 60)  # 4 m by 3 m


def test_only_changed_masks_are_sent_again() -> None:
    zones = Zones((SQUARE,), ((EAST, 0.2),))
    masks = ZoneMasks(surroundings(keepout=zones.keepout, speed_zones=zones.speed), NO_ZONES)
    assert [topic for topic, _ in masks.changed_masks(zones)] == [KEEPOUT_ZONES, SPEED_ZONES]
    assert list(masks.changed_masks(zones)) == []
    assert [topic for topic, _ in masks.changed_masks(Zones((), zones.speed))] == [KEEPOUT_ZONES]
