"""Tests of the data of replay pages."""

import base64
import json
import math
import re
import struct
import zlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.core.records.case import Case
from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.criteria.registry import AnyCriterion
from simscen.judge.run_result import judge_run
from simscen.record.log_header import LogHeader
from simscen.record.log_reader import Log
from simscen.record.messages.encode import occupancy_grid
from simscen.record.sensor_messages import SensorMessages
from simscen.record.topics import GLOBAL_COSTMAP
from simscen.report.replay import replay_page
from simscen.report.replay.packed_columns import (
    PackedColumns,
    evenly_spaced_indices,
    extreme_indices,
    indices_spaced_in_time,
)
from simscen.report.replay.page import PAGE_FOLDER, joined_script
from simscen.report.replay.robot_data import costmaps_data, map_from_odom
from simscen.testing.synthetic_trace import synthetic_trace

TEXT = """\
simscen: 1
world: hall.world.yaml
robot: {pose: dock}
goals:
  - {pose: shelf}
  - {name: home, pose: {x: 0, y: 0}}
events:
  - name: push
    when: {time: 1 s}
    do: {mark: {name: pushed}}
pass:
  - goals_reached: {}
  - speed: {max: 0.4 m/s}
"""


def make_log(sketch: dict[str, Any], case: Case | None = None, text: str = "") -> Log:
    header = LogHeader("hall/drive", 7, case or Case(Pose2(0, 0), ()), text)
    return Log(header, synthetic_trace(sketch), "", True)


def make_result(*verdicts: Verdict) -> RunResult:
    return RunResult(RunKey("hall/drive", 7), "hall/drive.scenario.yaml", Outcome.FAILED, verdicts, simulated=4.0)


class ReplayData:
    """Data of a replay page, decoded as in the script of the page."""

    def __init__(self, page: bytes) -> None:
        match = re.search(r'<script type="application/octet-stream" id="data">([^<]*)</script>', page.decode())
        assert match is not None
        data = zlib.decompress(base64.b64decode(match[1]), wbits=-15)
        (size,) = struct.unpack_from("<I", data)
        self.runs = json.loads(data[4 : 4 + size])["runs"]
        self._numbers = data[4 + size :]

    def column(self, description: Sequence[float]) -> list[float]:
        """Return the values of a column with its offset in bytes, number of values, and step."""
        begin, count, step = description
        index, number, values = int(begin), 0, []
        for _ in range(int(count)):
            code, shift = 0, 0
            while True:
                byte = self._numbers[index]
                index += 1
                code |= (byte & 127) << shift
                shift += 7
                if byte < 128:
                    break
            number += (code >> 1) ^ -(code & 1)
            special = {2**30: math.inf, -(2**30): -math.inf, 2**30 + 1: math.nan}
            values.append(special.get(number, number * step))
        return values


@pytest.mark.parametrize("step", [1.0, 0.01, 1e-5])
def test_quantized_numbers_are_exact_to_half_a_step(step: float) -> None:
    values = np.concatenate(([0.0, -1e3, 1e3, math.inf, -math.inf], np.random.default_rng(3).normal(0, 50, 500)))
    columns = PackedColumns()
    columns.add([1.0])
    description = columns.add(values, step)
    data = ReplayData.__new__(ReplayData)
    data._numbers = columns.data
    decoded = np.array(data.column(description))
    assert np.array_equal(decoded[~np.isfinite(values)], values[~np.isfinite(values)])
    finite = np.isfinite(values)
    assert np.abs(decoded[finite] - values[finite]).max() <= step / 2 + 1e-9


def test_nan_remains_nan() -> None:
    columns = PackedColumns()
    description = columns.add([1.0, math.nan, 2.0])
    data = ReplayData.__new__(ReplayData)
    data._numbers = columns.data
    first, second, third = data.column(description)
    assert (first, third) == (1.0, 2.0) and math.isnan(second)


def test_replay_contains_positions_and_events_of_the_log() -> None:
    sketch = {
        "seconds": 4,
        "truth": [[0, 0, 0, 0], [2, 1, 0.5, 3.0], [4, 1, 2, -3.0]],
        "belief": {"offset": [0.1, 0, 0.05]},
        "events": [
            [0, "goal.accepted", "shelf"],
            [1, "event.started", "push", {"entry": 0}],
            [2, "plan.made", ""],
            [3, "goal.failed", "shelf", {"error_code": 208, "error_name": "NO_VALID_PATH"}],
        ],
    }
    log = make_log(sketch, Case(Pose2(0, 0), (Goal("shelf", Pose2(2, 2)), Goal("home", Pose2(0, 0)))), TEXT)
    data = ReplayData(replay_page([(log, make_result())]))
    run = data.runs[0]
    robot = run["robots"][0]
    truth = np.column_stack([data.column(robot["truth"][name]) for name in ("ticks", "x", "y")])
    assert np.array_equal(truth[:, 0], log.trace.truth.ticks)
    assert np.abs(truth[:, 1:] - log.trace.truth.values[:, :2]).max() <= 0.0005 + 1e-9
    yaw_error = np.exp(1j * np.array(data.column(robot["truth"]["yaw"]))) / np.exp(1j * log.trace.truth.values[:, 2])
    assert np.abs(np.angle(yaw_error)).max() <= 0.0005 + 1e-9
    belief_x = np.array(data.column(robot["belief"]["x"]))
    assert np.abs(belief_x - log.trace.belief.values[:, 0]).max() <= 0.0005 + 1e-9
    assert [(event["tick"], event["kind"]) for event in run["events"]] == [
        (event.tick, str(event.kind)) for event in log.trace.events
    ]
    goal = run["events"][0]
    assert (goal["until"], goal["ended"], goal["line"]) == (720, "goal.failed", 5)
    assert run["events"][1]["line"] == 8
    assert [goal["line"] for goal in robot["goals"]] == [5, 6]


def test_bound_is_drawn_on_its_signal() -> None:
    finding = Finding(Status.FAIL, "speed", "0.50 m/s", "≤ 0.40 m/s", -0.1, "m/s", 0.5, 240, (1.0, 0.0))
    log = make_log({"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]]}, text=TEXT)
    run = ReplayData(replay_page([(log, make_result(Verdict("speed", "speed", "fail", (finding,))))])).runs[0]
    bound = {"signal": "speed", "value": 0.4, "is_minimum": False, "verdict": "speed", "status": "fail"}
    assert run["robots"][0]["limits"] == [bound]
    assert run["verdicts"][0]["line"] == 13
    assert "speed" in [strip["name"] for strip in run["robots"][0]["strips"]]


def test_bound_on_the_root_mean_square_is_not_drawn_on_the_signal() -> None:
    finding = Finding(Status.PASS, "localization_error rmse", "0.05 m", "≤ 0.10 m", 0.05, "m", 0.05)
    log = make_log({"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]]})
    verdict = Verdict("localization_error", "localization_error", "fail", (finding,))
    assert ReplayData(replay_page([(log, make_result(verdict))])).runs[0]["robots"][0]["limits"] == []


def test_overlapping_faults_with_one_name_end_separately() -> None:
    events = [
        [1, "fault.started", "lidar.off", {"entry": 0}],
        [2, "fault.started", "lidar.off", {"entry": 1}],
        [3, "fault.ended", "lidar.off", {"entry": 0}],
    ]
    log = make_log({"seconds": 4, "truth": [[0, 0, 0]], "events": events})
    entries = ReplayData(replay_page([(log, make_result())])).runs[0]["events"]
    assert [(entry["tick"], entry["until"]) for entry in entries if entry["kind"] == "fault.started"] == [
        (240, 720),
        (480, 960),
    ]


def test_goal_of_several_loops_is_listed_once() -> None:
    goals = (Goal("shelf", Pose2(2, 2)), Goal("shelf#2", Pose2(2, 2)))
    log = make_log({"seconds": 1, "truth": [[0, 0, 0]]}, Case(Pose2(0, 0), goals))
    assert [goal["name"] for goal in ReplayData(replay_page([(log, make_result())])).runs[0]["robots"][0]["goals"]] == [
        "shelf"
    ]


def test_log_with_little_data_gives_a_small_page() -> None:
    log = make_log({"seconds": 1, "truth": [[0, 0, 0]], "belief": None, "scans": [], "ended": None})
    run = ReplayData(replay_page([(replace(log, complete=False), make_result())])).runs[0]
    assert run["complete"] is False and run["robots"][0]["belief"] is None and run["robots"][0]["map"] is None


def test_equal_runs_give_equal_bytes_and_two_runs_one_page() -> None:
    log = make_log({"seconds": 2, "truth": [[0, 0, 0], [2, 1, 0]]}, text=TEXT)
    page_bytes = replay_page([(log, make_result())])
    assert page_bytes == replay_page([(log, make_result())])
    assert [run["seed"] for run in ReplayData(replay_page([(log, make_result()), (log, make_result())])).runs] == [7, 7]


def test_thinning_keeps_ends_pauses_and_extremes() -> None:
    assert evenly_spaced_indices(3, 10).tolist() == [0, 1, 2] and evenly_spaced_indices(100, 3).tolist() == [0, 50, 99]
    ticks = np.array([0, 6, 12, 18, 24, 264, 504, 510])
    kept = ticks[indices_spaced_in_time(ticks, 12)].tolist()
    assert kept == [0, 12, 24, 264, 504, 510]
    values = np.zeros(10_000)
    values[[1234, 7777]] = 5.0, -5.0
    chosen = extreme_indices(values, 100)
    assert len(chosen) <= 100 and {1234, 7777} <= set(chosen.tolist())


def test_script_is_one_module_and_never_creates_markup_from_text() -> None:
    text = joined_script()
    assert not re.search(r"^(import|export) ", text, re.MULTILINE)
    assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\b|new Function", text)
    assert "</script" not in text.lower()
    for module in PAGE_FOLDER.glob("*.js"):
        for name in re.findall(r"^export (?:async )?(?:function|class|const) (\w+)", module.read_text(), re.MULTILINE):
            assert len(re.findall(rf"^(?:async )?(?:function|class|const) {name}\b", text, re.MULTILINE)) == 1


def test_local_costmap_is_drawn_at_the_estimated_odom_frame() -> None:
    """The odometry is exact, and the belief has an offset and a rotation, so that `map_from_odom` has them, too."""
    log = make_log({"seconds": 2, "truth": [[0, 1, 0, 0], [2, 3, 0, 0]], "belief": {"offset": [0.5, 1.0, np.pi / 2]}})
    correction = map_from_odom(log.trace, 240)
    belief = log.trace.belief.at(np.array([240]))[0]
    odometry = Pose2(*log.trace.odometry.at(np.array([240]))[0])
    assert correction.compose(odometry) == pytest.approx(tuple(belief[:3]))


@pytest.mark.filterwarnings("ignore:overflow")
def test_page_is_valid_if_the_square_of_an_error_overflows() -> None:
    trace = make_log({"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]], "belief": [[0, 0, 0], [4, 1e200, 0]]}).trace
    case = Case(Pose2(0, 0), ())
    criteria = [AnyCriterion.model_validate({"localization_error": {key: 0.1}}) for key in ("rmse", "max", "final")]
    result = judge_run(RunKey("hall/drive", 7), "", criteria, trace, case)
    (run,) = ReplayData(replay_page([(Log(LogHeader("hall/drive", 7, case, ""), trace, "", True), result)])).runs
    assert [verdict["status"] for verdict in run["verdicts"]] == ["fail"] * 3
    assert "ape_trans_rmse" not in run["metrics"]


@pytest.mark.parametrize("garbage", [math.nan, math.inf])
def test_local_costmap_is_drawn_in_the_map_frame_if_the_odometry_is_garbage(garbage: float) -> None:
    trace = make_log({"seconds": 2, "truth": [[0, 1, 0, 0], [2, 3, 0, 0]]}).trace
    odometry = Samples(trace.odometry.ticks, np.full_like(trace.odometry.values, garbage))
    assert map_from_odom(replace(trace, odometry=odometry), 240) == Pose2(0.0, 0.0)


def test_grids_of_equal_size_are_stored_as_differences() -> None:
    cells = np.zeros((3, 4), dtype=np.int8)
    smaller_grid = np.full((2, 2), 50, dtype=np.int8)
    sensors = SensorMessages(Clock(240))
    grids_by_tick = [(0, cells), (240, cells + 7), (480, cells)]
    handler = sensors.handler(GLOBAL_COSTMAP.name, GLOBAL_COSTMAP.type)
    assert handler is not None
    for tick, grid in grids_by_tick:
        handler(tick, occupancy_grid("map", (tick // 240, 0), OccupancyGrid(grid, 0.05, Pose2(1.0, 2.0))))
    handler(720, occupancy_grid("map", (3, 0), OccupancyGrid(smaller_grid, 0.05, Pose2(1.0, 2.0))))
    columns = PackedColumns()
    log = make_log({"seconds": 4, "truth": [[0, 0, 0], [4, 0, 0]]})
    (costmap,) = costmaps_data(sensors, log.trace, columns)
    data = ReplayData.__new__(ReplayData)
    data._numbers = columns.data
    grids = [(grid["tick"], grid["changes"], set(data.column(grid["cells"]))) for grid in costmap["grids"]]
    assert grids == [(0, False, {0}), (240, True, {7}), (480, True, {-7}), (720, False, {50})]
    assert costmap["grids"][0]["origin"] == [1.0, 2.0, 0.0]
