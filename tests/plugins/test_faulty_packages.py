"""Tests of faulty components of packages: the run never passes, and the message names the component."""

from textwrap import dedent

import pytest

from simscen.core.errors import RunError
from simscen.core.records.run_result import Outcome
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

ROBOT = """\
simscen: 1
name: r
mass: 8 kg
radius: 0.2
body: [{cylinder: [0.2, 0.25], z: 0.05}]
drive: {type: differential, wheel_radius: 0.05, wheel_separation: 0.3}
limits: {linear: 0.6, angular: 1.5, linear_acceleration: 1.5, angular_acceleration: 3}
sensors: {lidar: {lidar: {beams: 90}}, odom: {odometry: {}}, %s}
"""
SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {model: r.robot.yaml, pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 2 s
pass: [{collisions: {}}%s]
"""
HEAD = """\
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.actions.base import Action
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Bump, Scan
from simscen.core.stage import Effect
from simscen.core.records.verdict import Finding, Status
from simscen.criteria.base import Criterion
from simscen.criteria.base import Measure
from simscen.faults.base import FaultEffect, Fault
from simscen.model.sensors import SensorSpec
from simscen.spec.base import Spec
from simscen.triggers.base import Condition
"""
HEADS = {
    "criterion": "class Mine(Spec, Criterion):\n    def judge(self, trace, case):\n        ",
    "metric": "class Mine(Spec, Measure):\n    def measure(self, trace, case):\n        ",
    "trigger": "class Mine(Spec, Condition):\n    def holds(self, now):\n        ",
    "action": "class Mine(Spec, Action):\n    def perform(self, stage):\n        ",
    "fault": "class Mine(Spec, Fault):\n"
    "    affects: ClassVar = frozenset({'Scan', 'Command', 'Wheels', 'Belief', 'Map'})\n"
    "    def begin(self, rng, setting):\n        return Broken()\n\nclass Broken(FaultEffect):\n    ",
    "sensor": "class Mine(SensorSpec):\n    component: ClassVar = 'mine:Device'\n"
    "    reading_type: ClassVar = 'Scan'\n\n"
    "class Device:\n    def __init__(self, spec, setting): self.setting = setting\n    def read(self, tick):\n        ",
}
LINE = len(f"{HEAD}\n\n".splitlines()) + 3
"""Line of the code of a criterion or metric in its file."""
USES = {
    "criterion": (", {mine: {}}", ""),
    "metric": ("]\nmetrics: [{mine: {}}", ""),
    "trigger": ("]\nevents: [{when: {mine: {}}, do: {push: {impulse: [0, 1]}}}", ""),
    "action": ("]\nevents: [{when: {time: 0.5}, do: {mine: {}}}", ""),
    "fault": ("]\nfaults: [{sensor: lidar, mine: {}, when: {time: 0.5}}", ""),
    "sensor": ("", "extra: {mine: {rate: 10}}"),
}


@pytest.fixture
def run(packages, tmp_path):
    """Return `run(kind, text)`: simulate 2 s with a component `mine` of this kind and with this code."""

    def simulate_with(kind: str, text: str, sensor: str = "lidar"):
        packages("mines", "0.3", {kind: {"mine": "mine:Mine"}}, mine=f"{HEAD}\n\n{HEADS[kind]}{dedent(text)}\n")
        scenario, robot = USES[kind]
        (tmp_path / "r.robot.yaml").write_text(ROBOT % robot)
        if sensor == "map":
            scenario = scenario.replace(", when: {time: 0.5}", "")
        (tmp_path / "s.scenario.yaml").write_text((SCENARIO % scenario).replace("sensor: lidar", f"sensor: {sensor}"))
        return simulate(prepare(load_scenario(tmp_path / "s.scenario.yaml", tmp_path))).result

    return simulate_with


FINDING = "Finding(Status.{}, 'mine', '1', '2', {})"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("return []", "it returned no findings (criterion `mine` of mines 0.3)"),
        ("return None", "it returned no findings"),
        ("return [None]", "it returned an invalid finding of type NoneType"),
        (
            f"return [{FINDING.format('PASS', 'float(chr(110) + chr(97) + chr(110))')}]",
            "the margin of mine is not a number",
        ),
        (f"return [{FINDING.format('PASS', -1.0)}]", "mine has the status pass but a margin of -1"),
        (f"return [{FINDING.format('FAIL', 1.0)}]", "mine has the status fail but a margin of 1"),
        ("return [Finding(Status.PASS, 'mine', 1, '2')]", "a text of its finding is not a string"),
        ("raise KeyError('gone')", f"KeyError: 'gone', at mine.py:{LINE} (criterion `mine` of mines 0.3)"),
    ],
)
def test_criterion_without_findings_makes_the_run_an_error(run, text: str, message: str) -> None:
    result = run("criterion", text)
    assert result.outcome is Outcome.ERROR
    assert result.error is not None and message in result.error.message


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "return float(chr(110) + chr(97) + chr(110))",
            "metric mine is not a finite number: nan (metric `mine` of mines 0.3)",
        ),
        ("return None", "metric mine is not a finite number: None"),
        ("return True", "metric mine is not a finite number: True"),
        ("return 1 / 0", f"division by zero, at mine.py:{LINE} (metric `mine` of mines 0.3)"),
        ("return np.array([1]) @ np.zeros(2)", f"at mine.py:{LINE} (metric `mine` of mines 0.3)"),
    ],
)
def test_nonnumeric_metric_makes_the_run_an_error(run, text: str, message: str) -> None:
    result = run("metric", text)
    assert result.outcome is Outcome.ERROR
    assert result.error is not None and message in result.error.message


def test_undefined_metric_has_a_reason(run) -> None:
    result = run("metric", "return 'no pedestrian'")
    assert result.outcome is Outcome.PASSED
    assert (result.metrics["mine"], result.undefined["mine"]) == (None, "no pedestrian")


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("kind", "text", "error", "message"),
    [
        (
            "trigger",
            "return 1",
            "broken-component",
            "1 instead of True or False (trigger `mine` of mines 0.3)",
        ),
        ("trigger", "return now.nothing", "crashed", "trigger `mine` of mines 0.3: AttributeError: "),
        ("action", "return None", "broken-component", "None, which is not an Effect (action `mine` of mines 0.3)"),
        (
            "action",
            "return Effect(True, 'done')",
            "broken-component",
            "the effect `done`, but changed nothing (action `mine`",
        ),
        ("action", "raise ValueError('no')", "crashed", "action `mine` of mines 0.3: ValueError: no (mine.py:"),
        (
            "fault",
            "def reading(self, reading): return 3",
            "broken-component",
            "returned an object of type int for a Scan",
        ),
        ("fault", "def reading(self, reading): reading.ranges[:] = 0; return reading", "crashed", "read-only"),
        ("fault", "def reading(self, reading): return 1 / 0", "crashed", "fault `mine` of mines 0.3: ZeroDivision"),
        ("sensor", "return 1 / 0", "crashed", "sensor `extra` (mine, mine:Device): ZeroDivisionError: "),
        (
            "sensor",
            "return Bump('extra', tick, True)",
            "broken-component",
            "returned Bump, but its specification declares Scan",
        ),
        (
            "sensor",
            "return Scan('x', tick, np.ones(3), 0., 1., 0., 9.)",
            "broken-component",
            "a reading of `x`",
        ),
        (
            "sensor",
            "return Scan('extra', tick, -np.ones(3), 0., 1., 0., 9.)",
            "broken-component",
            "is not an array of",
        ),
        ("sensor", "return Scan('extra', tick, np.ones(3), np.nan, 1., 0., 9.)", "broken-component", "is not finite"),
        (
            "sensor",
            "return Scan('extra', tick, np.ones((2, 3)), 0., 1., 0., 9.)",
            "broken-component",
            "`ranges` is not",
        ),
        ("sensor", "return Scan('extra', tick, np.ones(3), 0., 0., 0., 9.)", "broken-component", "increment` is 0"),
        (
            "sensor",
            "return Scan('extra', tick, np.ones(3), 0., 1., 0., 9., ('x',))",
            "broken-component",
            "`mount` does",
        ),
    ],
)
def test_invalid_result_of_a_component_is_an_error_with_its_name(run, kind, text, error, message) -> None:
    with pytest.raises(RunError) as raised:
        run(kind, text)
    assert raised.value.kind == error
    assert message in str(raised.value)


def test_invalid_command_from_a_fault_is_an_error_with_its_name(run) -> None:
    with pytest.raises(
        RunError,
        match=r"returned Twist\(vx=nan.* for a command, which is not a finite Twist \(fault `mine` of mines 0.3\)",
    ):
        run("fault", "def command(self, command): return Twist(float('nan'), 0.0, 0.0)", sensor="cmd_vel")


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("instance", "text", "why"),
    [
        ("wheels", "def command(self, command): return None", "returned None for a command"),
        (
            "lidar",
            "def arriving_readings(self): return ['late']",
            "returned 'late' from `arriving_readings`, not a reading of `lidar`",
        ),
        ("lidar", "def arriving_readings(self): return None", "returned None from `arriving_readings`"),
        ("localizer", "def belief(self, belief): return 'here'", "returned 'here' for a belief"),
        ("cmd_vel", "def arriving_command(self): return 'go'", "returned 'go' for a command"),
    ],
)
def test_output_of_a_fault_is_validated_for_every_target(run, instance: str, text: str, why: str) -> None:
    with pytest.raises(RunError, match=rf"{why}.*\(fault `mine` of mines 0.3\)"):
        run("fault", text, sensor=instance)


def test_invalid_map_from_a_fault_is_an_error_with_its_name(run) -> None:
    with pytest.raises(RunError, match=r"returned an object of type str for a map \(fault `mine` of mines 0.3\)"):
        run(
            "fault",
            "def map(self, grid): return 'here be dragons'",
            sensor="map",
        )


def test_fault_without_effect_fails_the_run(run) -> None:
    result = run("fault", "pass")
    assert result.outcome is Outcome.FAILED
    assert [one.happened for one in result.disturbances] == [False]


def test_action_without_effect_fails_the_run(run) -> None:
    result = run("action", "return Effect(False, 'it was there already')")
    assert result.outcome is Outcome.FAILED


def test_event_that_never_triggers_fails_the_run(run) -> None:
    result = run("trigger", "return np.bool_(False)")
    assert result.outcome is Outcome.FAILED


def test_missing_component_is_an_error_with_its_name(run, packages) -> None:
    with pytest.raises(RunError, match=r"sensor `extra`.*ModuleNotFoundError"):
        run("sensor", "pass\n\nMine.component = 'nowhere:Device'")
