"""Tests of the effects of faults on readings and motion in whole runs, against independent computations."""

import math
from pathlib import Path

import numpy as np
import pytest

from simscen.core.geometry.kinematics import STOP
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.records.events import EventKind
from simscen.core.records.run_result import Outcome
from simscen.core.records.trace import Moment
from simscen.judge.result_json import to_json
from simscen.judge.run_result import judge_run
from simscen.loading.scenario import load_scenario
from simscen.loading.scenario_text import criteria_of_text
from simscen.record.log_reader import read_log
from simscen.record.trace_difference import first_difference
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

ROOM = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: outer wall, points: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]}]
  obstacles: [{name: pane, box: [0.02, 3, 1], pose: {x: 5, y: 2}}]
  objects: [{name: crate, box: [0.4, 0.4, 0.4], pose: {x: 3, y: 3.4}}]
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 4, y: 1}}]
"""


class MomentLog:
    """A log that keeps all moments in memory."""

    def __init__(self) -> None:
        self.moments: list[Moment] = []

    def append(self, moment: Moment) -> None:
        self.moments.append(moment)


def play(text: str, folder: Path, head: str = ROOM, criteria: str = "pass: [{collisions: {max: 5}}]\n"):
    """Simulate a scenario; return the run and its moments."""
    file = folder / "own.scenario.yaml"
    file.write_text(head + text + criteria)
    log = MomentLog()
    run = simulate(prepare(load_scenario(file, folder)), attach=lambda rig, logs: [log])
    return run, log.moments


def scans(moments: list[Moment]) -> list[tuple[int, Scan]]:
    """Return the tick of arrival of each scan, and the scan."""
    return [(moment.tick, reading) for moment in moments for reading in moment.readings if isinstance(reading, Scan)]


def ranges_to_walls(x: float, y: float, angles: np.ndarray) -> np.ndarray:
    """Return the distances to the walls of an empty room of 8 m by 4 m."""
    with np.errstate(divide="ignore"):
        range_x = np.where(np.cos(angles) > 0, (8 - x) / np.cos(angles), -x / np.cos(angles))
        range_y = np.where(np.sin(angles) > 0, (4 - y) / np.sin(angles), -y / np.sin(angles))
    return np.minimum(range_x, range_y)


STATIONARY = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: outer wall, thickness: 0.002, points: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]}]
  obstacles: [{name: pane, box: [0.02, 3, 1], pose: {x: 5, y: 2}}]
  objects: [{name: crate, box: [0.4, 0.4, 0.4], pose: {x: 3, y: 3.4}}]
robot: {pose: {x: 2, y: 2, yaw: 0.3}}
stack: {localizer: {type: ground_truth}}
goals: []
time_limit: 1 s
"""


def test_beams_through_glass_measure_the_object_behind(tmp_path):
    _, moments = play("faults: [{sensor: lidar, glass: {of: [pane, crate]}}]\n", tmp_path, STATIONARY)
    for _, scan in scans(moments):
        error = scan.ranges - ranges_to_walls(2.0, 2.0, scan.angles() + 0.3)
        assert np.abs(error).max() < 0.06, "a beam hits the pane or the crate"


def test_share_of_beams_passes_through_glass(tmp_path):
    _, moments = play("faults: [{sensor: lidar, glass: {of: [pane], probability: 70 %}}]\n", tmp_path, STATIONARY)
    passes_pane = []
    for _, scan in scans(moments):
        bearing = scan.angles() + 0.3
        at_pane = np.abs(np.remainder(bearing + math.pi, 2 * math.pi) - math.pi) < math.atan2(1.4, 3)
        passes_pane += (scan.ranges[at_pane] > 2.99 / np.cos(bearing[at_pane]) + 0.2).tolist()
    assert np.mean(passes_pane) == pytest.approx(0.7, abs=0.06)


def test_rotated_lidar_measures_a_rotated_scene(tmp_path):
    fault = (
        "faults: [{sensor: lidar, extrinsic: {yaw: 10 deg, x: 5 cm}}, {sensor: lidar, glass: {of: [pane, crate]}}]\n"
    )
    _, moments = play(fault, tmp_path, STATIONARY.replace("box: [0.02, 3, 1]", "box: [0.02, 0.02, 1]"))
    x, y = 2 + 0.05 * math.cos(0.3), 2 + 0.05 * math.sin(0.3)
    for _, scan in scans(moments):
        error = scan.ranges - ranges_to_walls(x, y, scan.angles() + 0.3 + math.radians(10))
        assert np.mean(np.abs(error) < 0.06) > 0.9, "too many beams do not hit a wall"


LATE_LIDAR = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: outer wall, thickness: 0.002, points: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]}]
robot: {model: late.robot.yaml, pose: {x: 1, y: 1}}
stack: {localizer: {type: ground_truth}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 6 s
"""

LATE_ROBOT = """\
simscen: 1
name: late
mass: 2 kg
radius: 0.2 m
body: [{cylinder: [0.2, 0.2], z: 0.03}]
drive: {type: differential, wheel_radius: 0.033, wheel_separation: 0.287}
limits: {linear: 0.5, angular: 2, linear_acceleration: 1, angular_acceleration: 3.2}
sensors: {lidar: {lidar: {noise: 0, latency: 200 ms}}, odom: {odometry: {}}}
"""


@pytest.mark.parametrize("delay_fault", ["", "{sensor: lidar, delay: {latency: 100 ms}}, "])
def test_a_displaced_lidar_measures_before_its_scans_are_delayed(delay_fault: str, tmp_path):
    (tmp_path / "late.robot.yaml").write_text(LATE_ROBOT)
    _, moments = play(f"faults: [{delay_fault}{{sensor: lidar, extrinsic: {{yaw: 90 deg}}}}]\n", tmp_path, LATE_LIDAR)
    truth = {moment.tick: moment.truth.pose.plane for moment in moments if moment.truth}
    arrivals = [(tick, scan) for tick, scan in scans(moments) if scan.tick in truth]
    delayed = [(truth[scan.tick], scan) for tick, scan in arrivals if tick >= scan.tick + 48]
    assert len(delayed) > 20
    for pose, scan in delayed:
        error = scan.ranges - ranges_to_walls(pose.x, pose.y, scan.angles() + pose.yaw + math.radians(90))
        assert np.mean(np.abs(error) < 0.06) > 0.95, "measured from the pose at its arrival"


def test_a_lidar_that_is_pitched_down_sees_the_floor_as_a_wall(tmp_path):
    _, moments = play("faults: [{sensor: lidar, extrinsic: {pitch: 5 deg}}]\n", tmp_path, STATIONARY)
    height = 0.18
    for _, scan in scans(moments):
        range_ahead = scan.ranges[len(scan.ranges) // 2]
        assert range_ahead == pytest.approx(height / math.sin(math.radians(5)), abs=0.06)


def test_delayed_scans_arrive_in_the_next_cycle_with_the_stamp_of_measurement(tmp_path):
    _, moments = play("faults: [{sensor: lidar, delay: {latency: 0.111 s}}]\ntime_limit: 3 s\n", tmp_path)
    beats = [moment.tick for moment in moments]
    arrivals = scans(moments)
    assert [scan.tick for _, scan in arrivals] == [24 * k for k in range(len(arrivals))]
    for tick, scan in arrivals:
        assert tick == min(beat for beat in beats if beat >= scan.tick + round(0.111 * 240))


def test_base_stops_after_command_timeout_and_resumes(tmp_path):
    fault = "faults: [{sensor: cmd_vel, off: {}, when: {time: 3 s}, for: 2 s}]\ntime_limit: 8 s\n"
    run, moments = play(fault, tmp_path)
    speeds = {moment.tick / 240: moment.truth.twist.vx for moment in moments if moment.truth}
    assert speeds[3.0] > 0.3
    # 0.5 s without a command, then 0.5 m/s of speed at 1.5 m/s² of deceleration.
    assert speeds[3.4] > 0.3
    assert max(abs(v) for t, v in speeds.items() if 4.0 <= t <= 5.0) < 0.02
    assert max(v for t, v in speeds.items() if t > 5.2) > 0.3
    assert any(moment.decision.command != STOP for moment in moments if 4.2 <= moment.tick / 240 <= 4.8)
    assert run.result.disturbances[0].happened


def test_delayed_command_is_executed_later(tmp_path):
    fault = "faults: [{sensor: cmd_vel, delay: {latency: 300 ms}}]\ntime_limit: 4 s\n"
    _, moments = play(fault, tmp_path)
    command_tick = next(moment.tick for moment in moments if moment.decision.command.vx > 0.02)
    motion_tick = next(moment.tick for moment in moments if moment.truth and moment.truth.twist.vx > 0.005)
    assert 72 <= motion_tick - command_tick <= 72 + 18


def test_robot_with_weak_left_wheels_turns_left_and_odometry_measures_the_turn(tmp_path):
    fault = "faults: [{sensor: wheels, saturation: {left: 0.1 m/s}, when: {time: 2 s}, for: 0.6 s}]\ntime_limit: 4 s\n"
    _, moments = play(fault, tmp_path)
    turn_rates = [moment.truth.twist.wz for moment in moments if moment.truth and 2.3 < moment.tick / 240 < 2.55]
    assert np.mean(turn_rates) > 0.5
    readings = [o for moment in moments for o in moment.readings if isinstance(o, Odometry) and o.tick == 600]
    truth = next(moment.truth for moment in moments if moment.tick == 600)
    assert readings[0].pose.yaw == pytest.approx(truth.pose.plane.yaw, abs=0.05)


def test_localizer_jump_shifts_the_estimate_during_the_fault(tmp_path):
    fault = "faults: [{sensor: localizer, jump: {y: 0.5 m}, when: {time: 2 s}, for: 1 s}]\ntime_limit: 4 s\n"
    _, moments = play(fault, tmp_path)
    errors_m = {}
    for moment in moments:
        if moment.truth and moment.decision.belief:
            errors_m[moment.tick / 240] = moment.decision.belief.pose.distance(moment.truth.pose.plane)
    assert max(error for time, error in errors_m.items() if time < 2.0) < 0.2
    assert min(error for time, error in errors_m.items() if 2.05 < time < 2.95) > 0.3
    assert max(error for time, error in errors_m.items() if time > 3.1) < 0.2


def test_shifted_map_is_sent_to_the_stack_and_logged(tmp_path):
    fault = "faults: [{sensor: map, shift: {x: 30 cm}}]\ntime_limit: 6 s\n"
    run, moments = play(fault, tmp_path)
    (outcome,) = run.result.disturbances
    assert (outcome.happened, outcome.tick) == (True, 0)
    last = [moment for moment in moments if moment.truth and moment.decision.belief][-1]
    assert last.decision.belief.pose.x - last.truth.pose.x == pytest.approx(0.3, abs=0.1)


@pytest.mark.sample(3)
@pytest.mark.parametrize("value", ["nan", "inf", "zero", "negative", "huge", "empty", "short", "anything"])
def test_stack_survives_lidar_garbage(tmp_path, value):
    faults = (
        f"faults: [{{sensor: lidar, garbage: {{value: {value}}}, when: {{time: 1 s}}, for: 2 s}}]\ntime_limit: 25 s\n"
    )
    run, moments = play(faults, tmp_path, criteria="pass: [{collisions: {max: 0}}, {goals_reached: {}}]\n")
    assert run.result.outcome in (Outcome.PASSED, Outcome.FAILED)
    assert [event for moment in moments for event in moment.events if event.kind is EventKind.FAULT_ENDED]


@pytest.mark.parametrize("localizer", ["amcl", "ekf", "odometry"])
def test_localizers_survive_odometry_and_imu_garbage(tmp_path, localizer):
    values = ("nan", "inf", "negative", "huge")
    entries = [
        f"  - {{sensor: {sensor}, name: {sensor} {value}, garbage: {{value: {value}, probability: 50 %}}, "
        f"when: {{time: {1 + k} s}}, for: 0.5 s}}\n"
        for sensor in ("odom", "imu")
        for k, value in enumerate(values)
    ]
    text = f"stack: {{localizer: {{type: {localizer}}}}}\ntime_limit: 6 s\nfaults:\n{''.join(entries)}"
    run, _ = play(text, tmp_path)
    assert run.result.outcome in (Outcome.PASSED, Outcome.FAILED)


GARBAGE = "".join(f"  - {{sensor: {name}, garbage: {{}}, when: {{time: 1 s}}}}\n" for name in ("lidar", "odom", "imu"))
DELAYS = "".join(
    f"  - {{sensor: {name}, delay: {{latency: 0.3 s, jitter: 0.5 s}}, when: {{time: 1 s}}, for: 1 s}}\n"
    for name in ("lidar", "odom", "imu", "bumper", "cmd_vel")
)


@pytest.mark.parametrize("faults", [GARBAGE, DELAYS], ids=["garbage", "delays"])
def test_log_with_invalid_readings_is_judged_with_the_same_result(tmp_path, faults):
    criteria = "pass: [{collisions: {max: 5}}, {path_length: {max: 9}}, {localization_error: {max: 3}}]\n"
    file = tmp_path / "own.scenario.yaml"
    file.write_text(f"{ROOM}time_limit: 4 s\nfaults:\n{faults}{criteria}")
    run = simulate(prepare(load_scenario(file, tmp_path)), log=tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    logged_criteria = criteria_of_text(log.header.scenario, file.name, {}).pass_
    result = judge_run(run.result.key, run.result.path, logged_criteria, log.trace, log.header.case, run.result.lines)
    assert to_json(result) == to_json(run.result)
    assert first_difference(run.trace, log.trace) is None


TWO_ROBOTS = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: outer, points: [[0, 0], [8, 0], [8, 5], [0, 5], [0, 0]]}]
robots:
  a:
    pose: {x: 1, y: 1}
    goals: [{pose: {x: 3, y: 1}}]
    faults: [{sensor: cmd_vel, delay: {latency: 100 ms}}]
    pass: [{goals_reached: {}}]
  b:
    pose: {x: 1, y: 4}
    goals: [{pose: {x: 3, y: 4}}]
    faults:
      - {sensor: map, shift: {x: 5 cm}}
      - {sensor: lidar, glass: {of: [outer]}, when: {time: 1 s}, for: 1 s}
      - {sensor: localizer, jump: {y: 0.3 m}, when: {time: 2 s}, for: 1 s}
    pass: [{goals_reached: {}}]
time_limit: 5 s
"""


def test_fault_of_each_of_several_robots_happens(tmp_path):
    run, _ = play("", tmp_path, TWO_ROBOTS)
    happened = {outcome.disturbance.name: outcome.happened for outcome in run.result.disturbances}
    assert happened == dict.fromkeys(("a/cmd_vel.delay", "b/map.shift", "b/lidar.glass", "b/localizer.jump"), True)
