"""Each shipped scenario can fail: break the stack, take its disturbance away or tighten its bound, and it does.

A change is a list of (path into the YAML, new value); the scenario must then fail by the criterion that is named.
"""

import copy
import shutil
from pathlib import Path

import pytest
import yaml

from simscen.core.result import Outcome
from simscen.core.verdict import Status
from simscen.loading.scenario import load_scenario
from simscen.run.prepare import prepare
from simscen.run.simulate import simulate

ROOT = Path(__file__).parents[2]
NO_LOCALIZER = ("stack.localizer", {"type": "odometry"})
DRIFTING_ODOMETRY = ("faults", [{"sensor": "odom", "bias": {"turn_per_metre": 0.05}}])
ONE_RECOVERY = ("stack.recovery", {"number_of_retries": 1})

SHUT = {"close": {"name": "door meeting room"}}
CRATE_IN_THE_OTHER_WAY = {"spawn": {"name": "crate", "box": [0.5, 1.4, 1.0], "pose": {"x": 12.0, "y": 1.95}}}

CHANGES = {
    "navigation/goal": [("clearance", [("pass.2.clearance.min", 1.0)])],
    "navigation/patrol": [
        ("localization_error", [NO_LOCALIZER, DRIFTING_ODOMETRY]),
        ("goals_reached", [("goals.0.timeout", 2.0)]),
    ],
    "navigation/path_length": [("path_length", [("pass.1.path_length.max_ratio", 1.0)])],
    "navigation/zones": [("keepout", [("stack.keepout", [])])],
    "navigation/time_bound": [("time_to_goal", [("pass.1.time_to_goal.max", 5.0)])],
    "navigation/outdated_map": [("goals_reached", [("stack.costmap", {"obstacle_max_range": 0.05})])],
    "navigation/ros_map_world": [("localization_error", [NO_LOCALIZER, DRIFTING_ODOMETRY])],
    "navigation/goal_occupied": [("result", [("goals.0.pose", {"x": 3.0, "y": 5.0})])],
    "navigation/goal_outside_map": [("result", [("goals.0.pose", {"x": 3.0, "y": 5.0})])],
    "recovery/corridor_blocked_then_opened": [
        ("goals_reached", [ONE_RECOVERY]),
        ("recoveries", [("events", [])]),
    ],
    "recovery/blocked_for_good": [("result", [("events", [])])],
    "obstacles/pallet_on_plan": [("replans", [("events", [])])],
    "obstacles/cart_crossing": [("replans", [("events", [])])],
    "obstacles/door_closes": [("goals_reached", [("events.0.do", [SHUT, CRATE_IN_THE_OTHER_WAY])])],
    "faults/lidar_off": [
        ("stopped_within", [("stack.collision_monitor", {"enabled": False})]),
        ("goals_reached", [("faults.0.for", 85.0)]),
    ],
    "faults/lidar_noise": [("localization_error", [("pass.1.localization_error.max", 0.01)])],
    "faults/wheel_slip": [("localization_error", [NO_LOCALIZER])],
    "robots/car_three_point_turn": [("goals_reached", [("stack.planner", {"state_space": "dubins"})])],
    "robots/jackal_skids": [("localization_error", [NO_LOCALIZER])],
    "robots/omni_patrol": [
        ("localization_error", [NO_LOCALIZER, DRIFTING_ODOMETRY]),
    ],
    "robots/mecanum_errand": [
        ("localization_error", [NO_LOCALIZER, DRIFTING_ODOMETRY]),
    ],
    "robots/amr_aisle": [("time_to_goal", [("stack.controller.desired_linear_vel", 0.3)])],
    "localization/wrong_initial_estimate": [("localization_error", [NO_LOCALIZER])],
}
CASES = [(scenario, *change) for scenario, changes in CHANGES.items() for change in changes]


def test_every_shipped_scenario_is_in_the_table():
    shipped = {file.relative_to(ROOT / "scenarios").as_posix().removesuffix(".scenario.yaml")
               for file in (ROOT / "scenarios").rglob("*.scenario.yaml")}  # fmt: skip
    assert shipped - {name for name in shipped if name.startswith("corner_cases/")} == set(CHANGES)


@pytest.mark.parametrize(("scenario", "criterion", "changes"), CASES, ids=[f"{case[0]}:{case[1]}" for case in CASES])
def test_a_broken_scenario_fails_for_the_stated_reason(scenario, criterion, changes, tmp_path):
    result = run(changed(scenario, changes), scenario, tmp_path)
    assert result.outcome is Outcome.FAILED
    statuses = {verdict.status for verdict in result.verdicts if verdict.criterion == criterion}
    assert Status.FAIL in statuses, [(verdict.id, verdict.status.value) for verdict in result.verdicts]


class Loader(yaml.SafeLoader):
    """YAML 1.2 as far as scenarios need it: `off` is text."""


Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:bool" or first in "tTfF"]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


def changed(scenario: str, changes) -> dict:
    text = (ROOT / "scenarios" / f"{scenario}.scenario.yaml").read_text()
    spec = copy.deepcopy(yaml.load(text, Loader))
    for path, value in changes:
        *keys, last = [int(key) if key.isdigit() else key for key in path.split(".")]
        place = spec
        for key in keys:
            place = place[key] if isinstance(place, list) else place.setdefault(key, {})
        place[last] = value
    return spec


def run(spec: dict, scenario: str, root: Path):
    shutil.copytree(ROOT / "worlds", root / "worlds")
    file = root / "scenarios" / f"{scenario}.scenario.yaml"
    file.parent.mkdir(parents=True)
    file.write_text(yaml.safe_dump(spec))
    loaded = load_scenario(file, root)
    return simulate(prepare(loaded)).result
