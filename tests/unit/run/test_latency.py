"""Tests of the latency of sensors and the stack in a run."""

from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.loading.scenario import load_scenario
from simscen.run.assembly import assemble
from simscen.run.preparation import prepare
from simscen.run.robot_interface import SensorSuite

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{{name: outer wall, points: [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]}}]
robot: {{model: own.robot.yaml, pose: {{x: 1, y: 2}}}}
stack: {{localizer: {{type: ground_truth}}{stack}}}
goals: [{{pose: {{x: 3, y: 2}}, timeout: 30 s}}]
time_limit: 30 s
pass: [collisions: {{max: 0}}]
"""
ROBOT = """\
simscen: 1
name: own
mass: 2 kg
radius: 0.2 m
body: [{{cylinder: [0.2, 0.2], z: 0.03}}]
drive: {{type: differential, wheel_radius: 0.033, wheel_separation: 0.287}}
limits: {{linear: 0.5, angular: 2, linear_acceleration: 1, angular_acceleration: 3.2}}
sensors:
  lidar: {{lidar: {{noise: 0{lidar}}}}}
  odom: {{odometry: {{}}}}
{latency}
"""


def moments(tmp_path: Path, beats: int, stack: str = "", lidar: str = "", latency: str = "") -> list:
    """Return the first moments of a run; the texts are added to the stack, the lidar, and the robot file."""
    (tmp_path / "own.robot.yaml").write_text(ROBOT.format(lidar=lidar, latency=latency))
    file = tmp_path / "own.scenario.yaml"
    file.write_text(SCENARIO.format(stack=stack))
    prepared = prepare(load_scenario(file, tmp_path))
    rig = assemble(prepared, 1)
    (agent,) = rig.robots
    agent.stack.start(prepared.estimate, prepared.case.goals)
    taken_moments = []
    for _ in range(beats):
        tick = rig.simulation.tick
        agent.observe(tick)
        agent.decide(tick)
        taken_moments.append(agent.moment)
        agent.drive()
        rig.simulation.step(agent.schedule.ticks_until_next(tick))
    return taken_moments


def latencies(run: list, kind: type) -> set[int]:
    """Return the latencies in ticks of all readings of the type `kind`."""
    return {moment.tick - reading.tick for moment in run for reading in moment.readings if type(reading) is kind}


def test_delayed_readings_keep_the_tick_of_their_measurement(tmp_path: Path) -> None:
    run = moments(tmp_path, 60, lidar=", latency: 30 ms")
    assert latencies(run, Scan) == {7}
    assert latencies(run, Odometry) == {0}


def test_latencies_of_the_robot_apply_if_the_scenario_requests_them(tmp_path: Path) -> None:
    latency = "latency: {planner: 100 ms, controller: 10 ms, sensors: {lidar: 50 ms, odom: 10 ms}}"
    run = moments(tmp_path, 60, ", latency: robot", ", latency: 30 ms", latency)
    assert latencies(run, Scan) == {12}
    assert latencies(run, Odometry) == {0, 2}  # the ground truth for the localizer has no latency
    first = next(moment.tick for moment in run if moment.decision.command.vx > 0)
    assert first == 12 + 24 + 2  # the robot starts after the first scan
    without_request = moments(tmp_path, 60, "", ", latency: 30 ms", latency)
    assert latencies(without_request, Scan) == {7}
    assert next(moment.tick for moment in without_request if moment.decision.command.vx > 0) == 12


@pytest.mark.parametrize("stack", [", latency: {}", ", latency: robot", ", latency: {planner: 0 s, controller: 1 ms}"])
def test_zero_latency_is_bit_identical_to_no_latency(tmp_path: Path, stack: str) -> None:
    plain, zero = moments(tmp_path, 80), moments(tmp_path, 80, stack, ", latency: 0 s")
    for moment, other in zip(plain, zero, strict=True):
        assert (moment.tick, moment.truth, moment.decision.command) == (other.tick, other.truth, other.decision.command)
        assert moment.decision.events == other.decision.events


def test_latency_of_a_missing_sensor_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="`latency` names `sonar`, which is not a sensor of the robot"):
        moments(tmp_path, 1, latency="latency: {sensors: {sonar: 1 ms}}")


def test_delayed_readings_keep_their_order() -> None:
    class Sensor:
        name, period = "s", 4

        def read(self, tick: int) -> Odometry:
            return Odometry("s", tick, None, None)

    suite = SensorSuite([Sensor()], {"s": 10})
    assert suite.periods_and_latencies == ((4, 10),)
    assert [reading.tick for tick in range(30) for reading in suite.read(tick)] == [0, 4, 8, 12, 16]
