"""Tests of stack components of packages."""

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

ODD = Path(__file__).with_name("odd_components.py").read_text()
"""Module of the package."""
POINTS = {
    "planner": {"straight": "odd:Straight", "careful": "odd:Careful", "gone": "odd:Gone", "foreign": "odd:Wild"},
    "controller": {"wild": "odd:Wild"},
    "localizer": {"lost": "odd:Lost", "half": "odd:Half"},
    "behavior": {"nod": "odd:Nod"},
    "goal_checker": {"unsure": "odd:Unsure"},
    "stack": {"still": "odd:Still"},
}
TRUTH = {"type": "ground_truth"}


@pytest.fixture
def odd(packages) -> None:
    packages("odd", "1.2", POINTS, odd=ODD)


def driven(goal: Pose2 = Pose2(2.5, 1.0, 0.0), **stack: object) -> Drive:
    spec = StackSpec.model_validate({"localizer": TRUTH, **stack})
    world = Flatland().room(6, 4)
    world.boxes.append((2.9, 0.0, 3.0, 2.4))
    return drive(world, Pose2(1, 1), Goal("g", goal), grid=world.grid((-0.5, -0.5, 6.5, 4.5)), spec=spec)


def scenario(folder: Path, stack: str) -> Path:
    file = folder / "a.scenario.yaml"
    world = "{simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}"
    start = "robot: {model: turtlebot, pose: {x: 1, y: 1}}\ngoals: [{pose: {x: 2, y: 1}}]"
    file.write_text(
        f"simscen: 1\nworld: {world}\n{start}\ntime_limit: 20 s\nstack: {stack}\npass: [goals_reached: {{}}]\n"
    )
    return file


def test_a_planner_of_a_package_is_chosen_by_its_type_and_drives(odd) -> None:
    d = driven(planner={"type": "straight", "spacing": "4 cm"}).run(30)
    assert d.result == "SUCCEEDED"
    assert np.hypot(*np.diff(d.plans[0].points[:, :2], axis=0).T).max() <= 0.04


@pytest.mark.parametrize(
    ("stack", "expected"),
    [
        ("{planner: {type: strait}}", "`strait` is not one of the choices"),
        ("{planner: {type: straight, spacin: 1}}", "unknown key `spacin` in `stack.planner`"),
        ("{planner: {type: straight, spacing: -1}}", "must be greater than 0"),
        ("{planner: {type: gone}}", "planner `gone` of odd 1.2 cannot be used: `odd:Gone` does not exist"),
        ("{planner: {type: foreign}}", "is not a subclass of simscen.plugin.PlannerSpec"),
        ("{recovery: {behaviors: [nood]}}", "`nood` is not one of the choices"),
        ("{recovery: {behaviors: [{type: nood}]}}", "`nood` is not one of the choices"),
        ("{type: stil}", "`stil` is not one of the choices"),
        ("{type: still, patiance: 1}", "unknown key `patiance` in `stack`"),
    ],
)
def test_a_mistake_is_reported_at_its_position(odd, tmp_path: Path, stack: str, expected: str) -> None:
    with pytest.raises(InvalidInput) as wrong:
        load_scenario(scenario(tmp_path, stack), tmp_path)
    (problem,) = wrong.value.problems
    assert expected in problem.message
    assert problem.line == 6
    if expected.startswith("`"):
        assert problem.hint.startswith("did you mean"), problem.hint


@pytest.mark.parametrize(
    ("does", "kind", "expected"),
    [
        ("raise", "crashed", "KeyError: 'no such key' (odd.py:40)"),
        ("raise deep", "crashed", "LinAlgError: Singular matrix (odd.py:42)"),
        ("not begin", "crashed", "OSError: no such model (odd.py:33)"),
        ("nan", "broken-component", "returned a path with points that are not finite numbers"),
        ("shape", "broken-component", "returned a path whose points are (31, 2) instead of (n, 3): x, y, yaw"),
        ("list", "broken-component", "returned list instead of a Path"),
        ("nothing", "broken-component", "returned a path without points"),
        ("elsewhere", "broken-component", "from (1.50, 1.50) instead of the start (1.00, 1.00)"),
    ],
)
def test_exception_in_a_planner_is_an_error_with_its_name(odd, does: str, kind: str, expected: str) -> None:
    with pytest.raises(RunError) as broken:
        driven(planner={"type": "straight", "does": does}).run(1)
    assert broken.value.kind == kind
    assert str(broken.value).startswith("planner `straight` (odd:StraightPlanner)")
    assert expected in str(broken.value)


def test_a_path_through_a_wall_ends_the_run(odd) -> None:
    with pytest.raises(RunError, match=r"through the lethal cell at \(2\.9., 1\.00\)"):
        driven(Pose2(5.0, 1.0, 0.0), planner={"type": "straight"}).run(1)


@pytest.mark.parametrize(
    ("stack", "expected"),
    [
        ({"controller": {"type": "wild"}}, "controller `wild` (odd:WildController) commanded (inf, 0.0, 0.0)"),
        ({"localizer": {"type": "lost"}}, "localizer `lost` (odd:LostLocalizer) returned a Belief whose covariance"),
        ({"localizer": {"type": "half"}}, "HalfLocalizer has no method `on_odometry`, which every localizer needs"),
        ({"goal_checker": {"type": "unsure"}}, "goal_checker `unsure` (odd:UnsureChecker) returned 'perhaps'"),
    ],
)
def test_error_names_the_role_of_the_component(odd, stack: dict, expected: str) -> None:
    with pytest.raises(RunError) as broken:
        driven(**stack).run(1)
    assert broken.value.kind == "broken-component"
    assert expected in str(broken.value)


@pytest.mark.parametrize(
    ("role", "kind", "method", "replacement"),
    [
        ("goal_checker", "unsure", "UnsureChecker.reached", lambda *asked: np.array([True, False])),
        ("localizer", "lost", "LostLocalizer.belief", Belief(Pose2(0.0, 0.0), np.full((3, 3), None))),
        ("localizer", "lost", "LostLocalizer.belief", Belief(Pose2(10**400, 0.0), np.eye(3))),
    ],
)
def test_result_of_another_type_is_an_error_of_the_component(
    odd, monkeypatch, role: str, kind: str, method: str, replacement: object
) -> None:
    monkeypatch.setattr(f"odd.{method}", replacement, raising=False)
    monkeypatch.setattr("odd.LostLocalizer.reset", lambda *asked: None)
    with pytest.raises(RunError, match=rf"^{role} `{kind}`") as broken:
        driven(**{role: {"type": kind}}).run(1)
    assert broken.value.kind == "broken-component"


@pytest.mark.parametrize(
    ("command", "kind", "expected"),
    [
        (lambda *asked: Twist(math.nan), "broken-component", "which is not a finite velocity"),
        (lambda *asked: 1 / 0, "crashed", "ZeroDivisionError: division by zero (navigator.py:"),
    ],
)
def test_decision_of_shipped_components_is_validated(monkeypatch, command, kind: str, expected: str) -> None:
    monkeypatch.setattr(RegulatedPurePursuit, "command", command)
    with pytest.raises(RunError) as broken:
        driven().run(1)
    assert broken.value.kind == kind
    assert str(broken.value).startswith("stack `reference` (simscen.stack.build:configured_stack)")
    assert expected in str(broken.value)


def test_navigation_failure_is_not_an_error_of_the_run(odd) -> None:
    assert driven(Pose2(40.0, 0.0)).run(5).result == "FAILED"


def test_behavior_inherits_unset_parameters_from_recovery(odd) -> None:
    words = ["nod", {"type": "nod", "wait_duration": 1.0}, {"type": "spin", "spin_dist": 3.0}, "spin"]
    recovery = StackSpec.model_validate(
        {"recovery": {"behaviors": words, "wait_duration": 2.0, "spin_dist": 1.0}}
    ).recovery
    assert recovery.names == ["nod", "nod", "spin", "spin"]
    nod, long_nod, wide, spin = recovery.behavior_specs()
    assert (nod.wait_duration, long_nod.wait_duration) == (2.0, 1.0)  # type: ignore[attr-defined]
    assert (wide.spin_dist, spin.spin_dist) == (3.0, 1.0)  # type: ignore[attr-defined]


def test_a_behavior_of_a_package_runs_and_is_in_the_log_by_its_name(odd) -> None:
    d = driven(Pose2(2.95, 1.0, 0.0), recovery={"behaviors": ["nod"], "number_of_retries": 2}).run(20)
    assert [event.name for event in d.events_of_kind("recovery.started")] in ([], ["nod", "nod"])
    d = driven(Pose2(2.5, 1.0), controller={"type": "regulated_pure_pursuit"}, recovery={"behaviors": ["nod"]})
    d.world.boxes.append((1.6, 0.0, 1.7, 4.0))
    d.run(30)
    assert {event.name for event in d.events_of_kind("recovery.started")} == {"nod"}


def test_a_behavior_of_a_package_is_named_in_triggers_criteria_and_the_schema(odd, tmp_path: Path) -> None:
    file = scenario(tmp_path, "{recovery: {behaviors: [nod, {type: nod, wait_duration: 1.0}]}}")
    text = file.read_text().replace("pass: [", "pass: [recoveries: {max: 3, name: nod}, ")
    events = "events: [{name: e, when: {recovery: {name: nod}}, do: {cancel_goal: {}}}]\n"
    file.write_text(text + events)
    schema = tmp_path / "schema.json"
    schema.write_text(as_text(schema_of("scenario", with_plugins=True)))
    assert load_scenario(file, tmp_path).spec.stack.recovery.names == ["nod", "nod"]
    checked = [sys.executable, "-m", "check_jsonschema", "--schemafile", str(schema), str(file)]
    assert subprocess.run(checked, check=False, capture_output=True).returncode == 0
    file.write_text((text + events).replace("name: nod", "name: nood"))
    with pytest.raises(InvalidInput) as wrong:
        load_scenario(file, tmp_path)
    assert [problem.hint for problem in wrong.value.problems] == ["did you mean `nod`?"] * 2
    assert subprocess.run(checked, check=False, capture_output=True).returncode == 1


def test_components_have_independent_random_streams(odd) -> None:
    own, others = driven(Pose2(5, 1)), driven(Pose2(5, 1), planner={"type": "careful"})
    assert own.run(20).commands == others.run(20).commands


def test_stack_of_a_package_is_checked_at_each_tick(odd, tmp_path: Path) -> None:
    spec = load_scenario(scenario(tmp_path, "{type: still, keepout: []}"), tmp_path).spec.stack
    assert type(pickle.loads(pickle.dumps(spec))) is type(spec)
    stack = build_stack(spec, driven_setting(), Streams(1), Clock(TICK_RATE_HZ))
    assert stack.decide(0, ()).command == (0.0, 0.0, 0.0)
    with pytest.raises(RunError, match=r"stack `still` \(odd:StillStack\) returned str instead of a Decision"):
        stack.decide(60, ())
    with pytest.raises(RunError, match="returned NoneType instead of a Decision"):
        build_stack(spec, driven_setting(), Streams(1), Clock(TICK_RATE_HZ)).decide(120, ())


@pytest.mark.parametrize("name", ["events", "lines", "costmaps", "odometry"])
def test_a_decision_without_a_tuple_of_messages_is_an_error_of_the_stack(
    odd, tmp_path: Path, monkeypatch, name
) -> None:
    spec = load_scenario(scenario(tmp_path, "{type: still, keepout: []}"), tmp_path).spec.stack
    monkeypatch.setattr("odd.StillStack.decide", lambda *asked: Decision(STOP, **{name: None}))
    stack = build_stack(spec, driven_setting(), Streams(1), Clock(TICK_RATE_HZ))
    with pytest.raises(RunError, match=rf"stack `still` \(odd:StillStack\) returned NoneType as `Decision.{name}`"):
        stack.decide(0, ())


def test_stack_without_zone_support_is_detected_before_switching(odd, tmp_path: Path) -> None:
    spec = load_scenario(scenario(tmp_path, "{type: still, keepout: []}"), tmp_path).spec.stack
    assert not build_stack(spec, driven_setting(), Streams(1), Clock(TICK_RATE_HZ)).can_switch_zones
    assert build_stack(StackSpec(), driven_setting(), Streams(1), Clock(TICK_RATE_HZ)).can_switch_zones


def driven_setting():
    from simscen.stack.protocols import Surroundings

    return Surroundings(round_robot(), None, TICK_RATE_HZ)


def test_failure_without_a_nav2_code_is_a_contract_violation(odd) -> None:
    from simscen.model.planners import OmplPlanner
    from simscen.stack.validation.components import CheckedPlanner
    from simscen.testing.flatland import setting

    class Own(OmplPlanner):
        @classmethod
        def implementation(cls):
            return lambda spec, setting: type("P", (), {"plan": staticmethod(fail)})()

    def fail(*asked: object) -> None:
        raise NavigationFailure(208, "no way")  # type: ignore[arg-type]

    with pytest.raises(RunError, match="failed with 208, which is not an ErrorCode"):
        CheckedPlanner(Own(), setting(round_robot())).plan(None, Pose2(0, 0), Pose2(1, 1), 1)  # type: ignore[arg-type]
    assert ErrorCode.NO_VALID_PATH == 208


def test_belief_that_a_localizer_changes_in_place_is_checked_again() -> None:
    from simscen.model.localizers import GroundTruth
    from simscen.stack.validation.components import CheckedLocalizer
    from simscen.testing.flatland import setting

    methods = dict.fromkeys(("reset", "on_odometry", "on_scan", "on_imu"), lambda reading: None)
    own = SimpleNamespace(belief=Belief(Pose2(0, 0), np.eye(3)), **methods)

    class OwnSpec(GroundTruth):
        @classmethod
        def implementation(cls):
            return lambda spec, setting: own

    localizer = CheckedLocalizer(OwnSpec(type="ground_truth"), setting(round_robot()))
    assert localizer.belief is own.belief
    own.belief.covariance[0, 0] = math.nan
    with pytest.raises(RunError, match="covariance is not a finite array"):
        localizer.belief  # noqa: B018
