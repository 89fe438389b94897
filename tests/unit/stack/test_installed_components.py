"""Tests of stack components from installed packages: their use, and errors that name a defective component."""

import math
import pickle
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from simscen.cli.catalog.json_schema import as_text, schema_of
from simscen.core.clock import Clock
from simscen.core.errors import InvalidInput, RunError
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief, ErrorCode
from simscen.core.random_streams import Streams
from simscen.core.records.trace import Decision
from simscen.loading.scenario import load_scenario
from simscen.model.stack import StackSpec
from simscen.stack.build import build_stack
from simscen.stack.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from simscen.stack.protocols import NavigationFailure
from simscen.testing.flatland import TICK_RATE_HZ, Drive, Flatland, drive, round_robot

MODULE = Path(__file__).with_name("odd_components.py").read_text()
"""Text of the only module of the package."""
POINTS = {
    "planner": {
        "straight": "odd:Straight",
        "random_draws": "odd:RandomDraws",
        "missing": "odd:Missing",
        "controller": "odd:Infinite",
    },
    "controller": {"infinite": "odd:Infinite"},
    "localizer": {"wrong_shape": "odd:WrongShape", "incomplete": "odd:Incomplete"},
    "behavior": {"pause": "odd:Pause"},
    "goal_checker": {"not_boolean": "odd:NotBoolean"},
    "stack": {"stop": "odd:Stop"},
}
TRUTH = {"type": "ground_truth"}


@pytest.fixture
def odd(packages) -> None:
    packages("odd", "1.2", POINTS, odd=MODULE)


def start_drive(goal: Pose2 = Pose2(2.5, 1.0, 0.0), **stack: object) -> Drive:
    spec = StackSpec.model_validate({"localizer": TRUTH, **stack})
    world = Flatland().room(6, 4)
    world.boxes.append((2.9, 0.0, 3.0, 2.4))
    return drive(world, Pose2(1, 1), Goal("g", goal), grid=world.grid((-0.5, -0.5, 6.5, 4.5)), spec=spec)


def write_scenario(folder: Path, stack: str) -> Path:
    file = folder / "a.scenario.yaml"
    world = "{simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}"
    start = "robot: {model: turtlebot, pose: {x: 1, y: 1}}\ngoals: [{pose: {x: 2, y: 1}}]"
    file.write_text(
        f"simscen: 1\nworld: {world}\n{start}\ntime_limit: 20 s\nstack: {stack}\npass: [goals_reached: {{}}]\n"
    )
    return file


def test_a_planner_of_a_package_is_chosen_by_its_type_and_drives(odd) -> None:
    d = start_drive(planner={"type": "straight", "spacing": "4 cm"}).run(30)
    assert d.result == "SUCCEEDED"
    assert np.hypot(*np.diff(d.plans[0].points[:, :2], axis=0).T).max() <= 0.04


@pytest.mark.parametrize(
    ("stack", "expected"),
    [
        ("{planner: {type: strait}}", "`strait` is not one of the choices"),
        ("{planner: {type: straight, spacin: 1}}", "unknown key `spacin` in `stack.planner`"),
        ("{planner: {type: straight, spacing: -1}}", "must be greater than 0"),
        ("{planner: {type: missing}}", "planner `missing` of odd 1.2 cannot be used: `odd:Missing` does not exist"),
        ("{planner: {type: controller}}", "is not a subclass of simscen.plugin.PlannerSpec"),
        ("{recovery: {behaviors: [pausse]}}", "`pausse` is not one of the choices"),
        ("{recovery: {behaviors: [{type: pausse}]}}", "`pausse` is not one of the choices"),
        ("{type: stopp}", "`stopp` is not one of the choices"),
        ("{type: stop, patiance: 1}", "unknown key `patiance` in `stack`"),
    ],
)
def test_mistake_in_the_stack_is_reported_with_its_line_and_a_hint(
    odd, tmp_path: Path, stack: str, expected: str
) -> None:
    with pytest.raises(InvalidInput) as error:
        load_scenario(write_scenario(tmp_path, stack), tmp_path)
    (problem,) = error.value.problems
    assert expected in problem.message
    assert problem.line == 6
    if expected.startswith("`"):
        assert problem.hint.startswith("did you mean"), problem.hint


@pytest.mark.parametrize(
    ("defect", "kind", "expected"),
    [
        ("raise", "crashed", "KeyError: 'no such key' (odd.py:40)"),
        ("raise deep", "crashed", "LinAlgError: Singular matrix (odd.py:42)"),
        ("raise in constructor", "crashed", "OSError: no such model (odd.py:33)"),
        ("nan", "broken-component", "returned a path with points that are not finite numbers"),
        ("shape", "broken-component", "returned a path whose points are (31, 2) instead of (n, 3): x, y, yaw"),
        ("list", "broken-component", "returned list instead of a Path"),
        ("empty", "broken-component", "returned a path without points"),
        ("other start", "broken-component", "from (1.50, 1.50) instead of the start (1.00, 1.00)"),
    ],
)
def test_exception_in_a_planner_is_an_error_with_its_name(odd, defect: str, kind: str, expected: str) -> None:
    with pytest.raises(RunError) as error:
        start_drive(planner={"type": "straight", "defect": defect}).run(1)
    assert error.value.kind == kind
    assert str(error.value).startswith("planner `straight` (odd:StraightPlanner)")
    assert expected in str(error.value)


def test_a_path_through_a_wall_ends_the_run(odd) -> None:
    with pytest.raises(RunError, match=r"through the lethal cell at \(2\.9., 1\.00\)"):
        start_drive(Pose2(5.0, 1.0, 0.0), planner={"type": "straight"}).run(1)


@pytest.mark.parametrize(
    ("stack", "expected"),
    [
        (
            {"controller": {"type": "infinite"}},
            "controller `infinite` (odd:InfiniteController) commanded (inf, 0.0, 0.0)",
        ),
        (
            {"localizer": {"type": "wrong_shape"}},
            "localizer `wrong_shape` (odd:WrongShapeLocalizer) returned a Belief whose covariance",
        ),
        (
            {"localizer": {"type": "incomplete"}},
            "IncompleteLocalizer has no method `on_odometry`, which every localizer needs",
        ),
        (
            {"goal_checker": {"type": "not_boolean"}},
            "goal_checker `not_boolean` (odd:NotBooleanChecker) returned 'perhaps'",
        ),
    ],
)
def test_error_names_the_role_of_the_component(odd, stack: dict, expected: str) -> None:
    with pytest.raises(RunError) as error:
        start_drive(**stack).run(1)
    assert error.value.kind == "broken-component"
    assert expected in str(error.value)


@pytest.mark.parametrize(
    ("role", "kind", "method", "replacement"),
    [
        ("goal_checker", "not_boolean", "NotBooleanChecker.reached", lambda *args: np.array([True, False])),
        ("localizer", "wrong_shape", "WrongShapeLocalizer.belief", Belief(Pose2(0.0, 0.0), np.full((3, 3), None))),
        ("localizer", "wrong_shape", "WrongShapeLocalizer.belief", Belief(Pose2(10**400, 0.0), np.eye(3))),
    ],
)
def test_result_of_another_type_is_an_error_of_the_component(
    odd, monkeypatch, role: str, kind: str, method: str, replacement: object
) -> None:
    monkeypatch.setattr(f"odd.{method}", replacement, raising=False)
    monkeypatch.setattr("odd.WrongShapeLocalizer.reset", lambda *args: None)
    with pytest.raises(RunError, match=rf"^{role} `{kind}`") as error:
        start_drive(**{role: {"type": kind}}).run(1)
    assert error.value.kind == "broken-component"


@pytest.mark.parametrize(
    ("command", "kind", "expected"),
    [
        (lambda *args: Twist(math.nan), "broken-component", "which is not a finite velocity"),
        (lambda *args: 1 / 0, "crashed", "ZeroDivisionError: division by zero (navigator.py:"),
    ],
)
def test_error_in_a_shipped_component_is_an_error_of_the_stack(monkeypatch, command, kind: str, expected: str) -> None:
    monkeypatch.setattr(RegulatedPurePursuit, "command", command)
    with pytest.raises(RunError) as error:
        start_drive().run(1)
    assert error.value.kind == kind
    assert str(error.value).startswith("stack `reference` (simscen.stack.build:configured_stack)")
    assert expected in str(error.value)


def test_navigation_failure_is_not_an_error_of_the_run(odd) -> None:
    assert start_drive(Pose2(40.0, 0.0)).run(5).result == "FAILED"


def test_behavior_inherits_unset_parameters_from_recovery(odd) -> None:
    behaviors = ["pause", {"type": "pause", "wait_duration": 1.0}, {"type": "spin", "spin_dist": 3.0}, "spin"]
    recovery = StackSpec.model_validate(
        {"recovery": {"behaviors": behaviors, "wait_duration": 2.0, "spin_dist": 1.0}}
    ).recovery
    assert recovery.names == ["pause", "pause", "spin", "spin"]
    pause, long_pause, wide_spin, spin = recovery.behavior_specs()
    assert (pause.wait_duration, long_pause.wait_duration) == (2.0, 1.0)  # type: ignore[attr-defined]
    assert (wide_spin.spin_dist, spin.spin_dist) == (3.0, 1.0)  # type: ignore[attr-defined]


def test_a_behavior_of_a_package_runs_and_is_in_the_log_by_its_name(odd) -> None:
    d = start_drive(Pose2(2.5, 1.0), controller={"type": "regulated_pure_pursuit"}, recovery={"behaviors": ["pause"]})
    d.world.boxes.append((1.6, 0.0, 1.7, 4.0))
    d.run(30)
    assert {event.name for event in d.events_of_kind("recovery.started")} == {"pause"}


def test_a_behavior_of_a_package_is_named_in_triggers_criteria_and_the_schema(odd, tmp_path: Path) -> None:
    file = write_scenario(tmp_path, "{recovery: {behaviors: [pause, {type: pause, wait_duration: 1.0}]}}")
    text = file.read_text().replace("pass: [", "pass: [recoveries: {max: 3, name: pause}, ")
    events = "events: [{name: e, when: {recovery: {name: pause}}, do: {cancel_goal: {}}}]\n"
    file.write_text(text + events)
    schema = tmp_path / "schema.json"
    schema.write_text(as_text(schema_of("scenario", with_plugins=True)))
    assert load_scenario(file, tmp_path).spec.stack.recovery.names == ["pause", "pause"]
    schema_check = [sys.executable, "-m", "check_jsonschema", "--schemafile", str(schema), str(file)]
    assert subprocess.run(schema_check, check=False, capture_output=True).returncode == 0
    file.write_text((text + events).replace("name: pause", "name: pausse"))
    with pytest.raises(InvalidInput) as error:
        load_scenario(file, tmp_path)
    assert [problem.hint for problem in error.value.problems] == ["did you mean `pause`?"] * 2
    assert subprocess.run(schema_check, check=False, capture_output=True).returncode == 1


def test_components_have_independent_random_streams(odd) -> None:
    drive_without_draws, drive_with_draws = (
        start_drive(Pose2(5, 1)),
        start_drive(Pose2(5, 1), planner={"type": "random_draws"}),
    )
    assert drive_without_draws.run(20).commands == drive_with_draws.run(20).commands


def test_stack_of_a_package_is_checked_at_each_tick(odd, tmp_path: Path) -> None:
    spec = load_scenario(write_scenario(tmp_path, "{type: stop, keepout: []}"), tmp_path).spec.stack
    assert type(pickle.loads(pickle.dumps(spec))) is type(spec)
    stack = build_stack(spec, surroundings_without_map(), Streams(1), Clock(TICK_RATE_HZ))
    assert stack.decide(0, ()).command == (0.0, 0.0, 0.0)
    with pytest.raises(RunError, match=r"stack `stop` \(odd:StopStack\) returned str instead of a Decision"):
        stack.decide(60, ())
    with pytest.raises(RunError, match="returned NoneType instead of a Decision"):
        build_stack(spec, surroundings_without_map(), Streams(1), Clock(TICK_RATE_HZ)).decide(120, ())


@pytest.mark.parametrize("name", ["events", "lines", "costmaps", "odometry"])
def test_a_decision_without_a_tuple_of_messages_is_an_error_of_the_stack(
    odd, tmp_path: Path, monkeypatch, name
) -> None:
    spec = load_scenario(write_scenario(tmp_path, "{type: stop, keepout: []}"), tmp_path).spec.stack
    monkeypatch.setattr("odd.StopStack.decide", lambda *args: Decision(STOP, **{name: None}))
    stack = build_stack(spec, surroundings_without_map(), Streams(1), Clock(TICK_RATE_HZ))
    with pytest.raises(RunError, match=rf"stack `stop` \(odd:StopStack\) returned NoneType as `Decision.{name}`"):
        stack.decide(0, ())


def test_stack_without_zone_support_is_detected_before_switching(odd, tmp_path: Path) -> None:
    spec = load_scenario(write_scenario(tmp_path, "{type: stop, keepout: []}"), tmp_path).spec.stack
    assert not build_stack(spec, surroundings_without_map(), Streams(1), Clock(TICK_RATE_HZ)).can_switch_zones
    assert build_stack(StackSpec(), surroundings_without_map(), Streams(1), Clock(TICK_RATE_HZ)).can_switch_zones


def surroundings_without_map():
    from simscen.stack.protocols import Surroundings

    return Surroundings(round_robot(), None, TICK_RATE_HZ)


def test_planner_failure_without_an_error_code_is_an_error_of_the_run(odd) -> None:
    from simscen.model.planners import OmplPlanner
    from simscen.stack.validation.components import CheckedPlanner
    from simscen.testing.flatland import setting

    class FailingPlanner(OmplPlanner):
        @classmethod
        def implementation(cls):
            return lambda spec, setting: type("P", (), {"plan": staticmethod(fail)})()

    def fail(*args: object) -> None:
        raise NavigationFailure(208, "no way")  # type: ignore[arg-type]

    with pytest.raises(RunError, match="failed with 208, which is not an ErrorCode"):
        CheckedPlanner(FailingPlanner(), setting(round_robot())).plan(None, Pose2(0, 0), Pose2(1, 1), 1)  # type: ignore[arg-type]
    assert ErrorCode.NO_VALID_PATH == 208


def test_belief_that_a_localizer_changes_in_place_is_checked_again() -> None:
    from simscen.model.localizers import GroundTruth
    from simscen.stack.validation.components import CheckedLocalizer
    from simscen.testing.flatland import setting

    methods = dict.fromkeys(("reset", "on_odometry", "on_scan", "on_imu"), lambda reading: None)
    inner = SimpleNamespace(belief=Belief(Pose2(0, 0), np.eye(3)), **methods)

    class InnerSpec(GroundTruth):
        @classmethod
        def implementation(cls):
            return lambda spec, setting: inner

    localizer = CheckedLocalizer(InnerSpec(type="ground_truth"), setting(round_robot()))
    assert localizer.belief is inner.belief
    inner.belief.covariance[0, 0] = math.nan
    with pytest.raises(RunError, match="covariance is not a finite array"):
        localizer.belief  # noqa: B018
