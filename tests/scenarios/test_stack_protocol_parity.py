"""Tests that the reference stack behind the stack protocol gives the same log as in process."""

import os
from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import make_reader

from simscen.loading.scenario import load_scenario
from simscen.run.external.build import with_external_reference
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

ROOT = Path(__file__).parents[2]
DEFAULT = [
    "navigation/goal.scenario.yaml",
    "navigation/goal_outside_map.scenario.yaml",
    "faults/lidar_off.scenario.yaml",
    "corner_cases/goal_blocked_for_good.scenario.yaml",
    "robots/mecanum_errand.scenario.yaml",
]
ALL_TYPES = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}]
  regions: {slow: [[2, 0], [3, 0], [3, 6], [2, 6]], out: [[5, 3], [5.5, 3], [5.5, 3.5]]}
map: none
robot: {model: watcher.robot.yaml, pose: {x: 1, y: 1}}
stack:
  localizer: {type: ground_truth}
  # The external stack does not receive images, so the in-process stack must ignore them.
  costmap: {min_obstacle_height: 99 m, max_obstacle_height: 100 m}
  controller: {type: mppi, batch_size: 100}
  recovery: {number_of_retries: 0}
  keepout: [out]
  speed_zones: [{region: slow, speed_limit: 0.2}]
goals:
  - {name: a, pose: {x: 4, y: 1}}
  - {name: late, pose: {x: 6, y: 5}, timeout: 1}
  - {name: b, pose: {x: 2, y: 4}}
on_goal_failure: continue
events:
  - {when: {time: 1}, do: {new_goal: {name: detour, pose: {x: 2, y: 2}}}}
  - {when: {goal: {name: late, status: failed}, delay: 0.333}, do: {cancel_goal: {}}}
faults:
  - {sensor: odom, when: {time: 0.5}, for: 1, dropout: {probability: 0.5}}
time_limit: 20
pass: [{collisions: {max: 0}}]
"""
ROBOT = """\
simscen: 1
name: watcher
body: [{cylinder: [0.18, 0.25], z: 0.03}]
mass: 5 kg
drive: {type: differential, wheel_radius: 5 cm, wheel_separation: 0.25}
limits: {linear: 0.5, angular: 1, linear_acceleration: 1, angular_acceleration: 2}
sensors:
  front: {lidar: {rate: 8 Hz, beams: 90}}
  rear: {lidar: {rate: 6 Hz, beams: 40, mount: {x: -0.1, yaw: 3.1}}}
  odom: {odometry: {}}
  gyro: {imu: {rate: 48 Hz}}
  skirt: {bumper: {rate: 30 Hz}}
  eye: {camera: {rate: 2 Hz, width: 16, height: 12}}
"""


Messages = list[tuple[str, int, bytes]]


def messages_of_both(file: Path, root: Path, folder: Path) -> tuple[Messages, Messages]:
    """Return the messages of a scenario's log, with the stack in process and behind the protocol."""
    prepared = prepare(load_scenario(file, root))
    in_process = simulate(prepared, log=folder / "in_process.mcap")
    external = simulate(with_external_reference(prepared), log=folder / "external.mcap", stack_log=folder / "stack.log")
    assert external.result == in_process.result
    assert external.trace.events == in_process.trace.events
    return messages(folder / "in_process.mcap"), messages(folder / "external.mcap")


def messages(log: Path) -> Messages:
    """Return topic, time in ns, and content of each message in the order of the log."""
    with log.open("rb") as file:
        records = make_reader(file).iter_messages(log_time_order=False)
        return [(channel.topic, message.log_time, message.data) for _, channel, message in records]


SHIPPED = sorted(
    str(path.relative_to(ROOT / "scenarios"))
    for path in (ROOT / "scenarios").rglob("*.scenario.yaml")
    # Faults of the localizer do not work with external stacks.
    if "sensor: localizer" not in path.read_text()
)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "name",
    SHIPPED if os.environ.get("SIMSCEN_SERVED") == "all" else DEFAULT,
)
def test_stack_protocol_gives_the_same_log_as_in_process(name: str, tmp_path: Path) -> None:
    in_process, external = messages_of_both(ROOT / "scenarios" / name, ROOT, tmp_path)
    assert sum(len(data) for _, _, data in in_process) > 20_000
    assert external == in_process


@pytest.mark.slow
def test_stack_protocol_matches_for_all_message_and_goal_types(tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(ALL_TYPES)
    (tmp_path / "watcher.robot.yaml").write_text(ROBOT)
    in_process, external = messages_of_both(tmp_path / "a.scenario.yaml", tmp_path, tmp_path)
    assert sum(len(data) for _, _, data in in_process) > 20_000
    assert external == in_process


TWO_ROBOTS = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}]}
robots:
  a: {pose: {x: 1, y: 3}, goals: [{name: there, pose: {x: 2.5, y: 3.5}}]}
  b:
    pose: {x: 4, y: 3.2, yaw: 180 deg}
    stack: {controller: {type: dwb}}
    goals: [{name: there, pose: {x: 3, y: 2}}]
events: [{when: {time: 1}, do: {new_goal: {name: detour, pose: {x: 2, y: 4}}, robot: a}}]
time_limit: 4
pass: [{collisions: {max: 0}}]
"""


@pytest.mark.slow
def test_stack_protocol_matches_for_two_robots(tmp_path: Path) -> None:
    (tmp_path / "two.scenario.yaml").write_text(TWO_ROBOTS)
    in_process, external = messages_of_both(tmp_path / "two.scenario.yaml", tmp_path, tmp_path)
    assert sum(len(data) for _, _, data in in_process) > 20_000
    assert external == in_process


@pytest.mark.slow
def test_comparison_detects_another_stack(tmp_path: Path) -> None:
    prepared = prepare(load_scenario(ROOT / "scenarios/navigation/goal.scenario.yaml", ROOT))
    other_stack = with_external_reference(prepared)
    argv = other_stack.loaded.external_command and (
        *other_stack.loaded.external_command.argv[:-1],
        '{"controller": {"desired_linear_vel": 0.3}}',
    )
    other_stack = replace(
        other_stack,
        loaded=replace(other_stack.loaded, external_command=replace(other_stack.loaded.external_command, argv=argv)),
    )
    assert simulate(other_stack).result.metrics != simulate(prepared).result.metrics
