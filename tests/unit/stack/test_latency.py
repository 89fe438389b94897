"""Tests of the latency of stack components."""

import math
from itertools import pairwise

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP
from simscen.core.messages.goals import Goal
from simscen.core.messages.sensor_data import Readings, Scan
from simscen.model.localizers import GroundTruth
from simscen.model.stack import StackSpec
from simscen.model.stack_base import Latency
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.frames import Frames
from simscen.stack.latency_queue import LatencyQueue
from simscen.stack.odometry_history import OdometryHistory
from simscen.stack.protocols import Surroundings
from simscen.stack.reference import ReferenceStack
from simscen.testing.flatland import (
    CONTROL_PERIOD_TICKS,
    ODOMETRY_PERIOD_TICKS,
    TICK_RATE_HZ,
    Drive,
    Flatland,
    drive,
    round_robot,
)

START, FAR = Pose2(1.0, 1.0), Goal("far", Pose2(9.0, 1.0), timeout=60.0)


def start(world: Flatland | None = None, seed: int = 1, mapped: bool = True, **latency: float) -> Drive:
    """Return a drive through a room of 10 x 3 m. The obstacles of `world` are not on the map."""
    room = Flatland().room(10, 3)
    world_with_room = Flatland([*room.boxes, *(world.boxes if world else [])], world.discs if world else [])
    spec = StackSpec(localizer=GroundTruth(type="ground_truth"), latency=Latency(**latency))
    return drive(
        world_with_room, START, FAR, grid=room.grid((-0.5, -0.5, 10.5, 3.5)) if mapped else None, spec=spec, seed=seed
    )


@pytest.mark.sample(2)
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("zero", [{}, dict.fromkeys(Latency.model_fields, 0.0), {"planner": 0.001, "costmap": 0.002}])
def test_zero_latency_is_bit_identical_to_unset_latency(seed: int, zero: dict[str, float]) -> None:
    """A latency of less than half a tick is rounded to zero."""
    world = Flatland(discs=[(4.0 + 0.3 * seed, 1.0, 0.3), (6.5, 1.2, 0.2)])
    with_zero, unset = start(world, seed, **zero).run(12), start(world, seed)
    unset.stack = drive(
        unset.world, START, FAR, grid=Flatland().room(10, 3).grid((-0.5, -0.5, 10.5, 3.5)), seed=seed
    ).stack  # a specification without the key `latency`
    unset.run(12)
    assert with_zero.log == unset.log
    assert with_zero.commands == unset.commands
    assert with_zero.track == unset.track
    assert len(with_zero.events_of_kind("plan.made")) > 1


def test_robot_waits_until_the_plan_is_computed() -> None:
    d = start(planner=0.2).run(1.0)
    made = d.events_of_kind("plan.made")[0].tick
    assert made - d.events_of_kind("goal.accepted")[0].tick == 0.2 * TICK_RATE_HZ
    assert set(d.commands[: made // ODOMETRY_PERIOD_TICKS]) == {STOP}
    assert d.commands[made // ODOMETRY_PERIOD_TICKS] != STOP


def test_controller_drives_on_while_the_planner_computes() -> None:
    world = Flatland()
    d = start(world, planner=1.0).run(2.0)
    d.world.discs.append((5.0, 1.0, 0.25))
    d.run(5.0)
    blocked = next(event.tick for event in d.events_of_kind("plan.made") if event.data["reason"] == "blocked")
    before = d.commands[(blocked - TICK_RATE_HZ) // ODOMETRY_PERIOD_TICKS : blocked // ODOMETRY_PERIOD_TICKS]
    assert all(command.vx > 0.3 for command in before)
    assert d.run(40).result == "SUCCEEDED"
    assert d.min_clearance > 0.02


@pytest.mark.parametrize(("latency", "delay_ticks"), [({"controller": 0.025}, 6), ({"collision_monitor": 0.05}, 12),
                                               ({"controller": 0.025, "collision_monitor": 0.025}, 12)])  # fmt: skip
def test_command_latency_is_the_sum_of_controller_and_monitor(latency: dict[str, float], delay_ticks: int) -> None:
    without_latency, with_latency = start().run(3.0), start(**latency).run(3.0)
    first = [
        next(k for k, c in enumerate(d.commands) if c != STOP) * ODOMETRY_PERIOD_TICKS
        for d in (without_latency, with_latency)
    ]
    assert first[1] - first[0] == delay_ticks
    assert with_latency.run(30).result == "SUCCEEDED"


def test_controller_slower_than_its_period_runs_less_often_with_equal_acceleration() -> None:
    d = start(controller=0.12).run(2.5)
    changes = [k for k, (a, b) in enumerate(pairwise(d.commands)) if a is not b]
    assert min(b - a for a, b in pairwise(changes)) * ODOMETRY_PERIOD_TICKS >= 2 * CONTROL_PERIOD_TICKS
    assert d.commands[-1].vx > 0.45
    assert d.run(40).result == "SUCCEEDED"


def test_delayed_costmap_marks_obstacles_at_their_positions_in_the_scan() -> None:
    """The robot has moved by half a meter when the costmaps are updated."""
    maps = Costmaps(StackSpec(), Surroundings(round_robot(), None, TICK_RATE_HZ), 0.5, latency=36)
    odometry, ranges = OdometryHistory(TICK_RATE_HZ), np.full(360, np.inf)
    ranges[180] = 1.0
    maps.add_reading(Scan("lidar", 0, ranges, -math.pi, math.pi / 180, 0.05, 12.0))
    for tick, x, count in ((0, 0.0, 0), (24, 0.3, 0), (36, 0.5, 1), (48, 0.6, 1)):
        pose = Pose2(x, 0.0)
        odometry.add(tick, pose)
        maps.update(tick, Frames(pose, pose), odometry)
        for view in (maps.local_costmap.view, maps.global_costmap.view):
            cells = np.argwhere(view.costs == 254)
            assert len(cells) == count
            assert cells[:, 1] * view.resolution + view.origin[0] == pytest.approx([1.0] * count, abs=0.051)


def test_first_update_that_takes_longer_than_the_period_starts_with_the_first_reading() -> None:
    maps = Costmaps(StackSpec(), Surroundings(round_robot(), None, TICK_RATE_HZ), 0.5, latency=500)
    odometry, ranges, pose = OdometryHistory(TICK_RATE_HZ), np.full(360, np.inf), Pose2(0.0, 0.0)
    ranges[180] = 1.0
    odometry.add(0, pose)
    maps.add_reading(Scan("lidar", 0, ranges, -math.pi, math.pi / 180, 0.05, 12.0))
    for tick in range(0, 600, 10):
        maps.update(tick, Frames(pose, pose), odometry)
        for view in (maps.local_costmap.view, maps.global_costmap.view):
            assert (view.costs == 254).any() == (tick >= 500)


def test_delayed_localizer_receives_scans_with_their_original_tick() -> None:
    d = start(localizer=0.05)
    received: list[tuple[int, int]] = []
    localizer = d.stack.inner._localizer
    localizer.on_scan = lambda scan: received.append((d.tick, scan.tick))
    d.run(0.5)
    assert {received_tick - scan_tick for received_tick, scan_tick in received} == {12}


def test_delayed_results_arrive_in_order_after_their_latency() -> None:
    queue = LatencyQueue[str](5)
    queue.put(0, "a")
    queue.put(3, "b")
    assert queue.due == 5
    assert queue.is_busy(4)
    assert queue.take() == "a"
    assert queue.due == 8
    assert queue.take() == "b"
    assert queue.due == math.inf
    assert not queue.is_busy(8)


def test_deferred_odometry_and_imu_readings_do_not_change_the_result(monkeypatch: pytest.MonkeyPatch) -> None:
    def drive_past_disc() -> Drive:
        return start(Flatland(discs=[(4.0, 1.0, 0.3)])).run(8.0)

    is_deferred = list[bool]()
    can_wait = ReferenceStack._can_wait

    def recording_can_wait(self: ReferenceStack, tick: int, readings: Readings) -> bool:
        is_deferred.append(can_wait(self, tick, readings))
        return is_deferred[-1]

    monkeypatch.setattr(ReferenceStack, "_can_wait", recording_can_wait)
    with_deferral = drive_past_disc()
    assert sum(is_deferred) > 100
    monkeypatch.setattr(ReferenceStack, "_can_wait", lambda *_: False)
    without_deferral = drive_past_disc()
    assert with_deferral.log == without_deferral.log
    assert with_deferral.commands == without_deferral.commands
    assert with_deferral.track == without_deferral.track
