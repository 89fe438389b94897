"""Tests of DWB against values computed by hand from Nav2's sources: golden/dwb.yaml."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.model.controllers import DynamicWindow as Spec
from simscen.stack.controllers.dwb.critics import OscillationCritic, RotateToGoalCritic, score_trajectories
from simscen.stack.controllers.dwb.trajectory_generator import (
    KinematicParameters,
    generate_trajectories,
    velocity_samples,
    velocity_window,
)
from simscen.stack.protocols import CostmapView

CASES = yaml.safe_load((Path(__file__).parent / "golden/dwb.yaml").read_text(encoding="utf-8"))
UNLIMITED = 1e9


def cases(kind: str) -> Any:
    """Return the decorator that runs a test with all cases of a kind."""
    selected = [case for case in CASES if case["kind"] == kind]
    assert all(case["origin"] for case in selected)
    return pytest.mark.parametrize("case", selected, ids=[case["name"] for case in selected])


def kinematics(
    acceleration: float = UNLIMITED, deceleration: float = -UNLIMITED, **options: Any
) -> KinematicParameters:
    low, high = (tuple(options.get(name, bound)) for name, bound in (("low", (-9,) * 3), ("high", (9,) * 3)))
    min_speeds = {name: options.get(name, 0.0) for name in ("min_speed_xy", "min_speed_theta")}
    return KinematicParameters(
        low, high, (acceleration,) * 3, (deceleration,) * 3, max_speed_xy=high[0], turning_radius=0, **min_speeds
    )


@cases("samples")
def test_velocity_samples_equal_those_of_dwb(case: dict[str, Any]) -> None:
    assert velocity_samples(**case["given"]) == pytest.approx(case["expect"], abs=1e-9)


@cases("window")
def test_velocity_window_equals_that_of_dwb(case: dict[str, Any]) -> None:
    given = dict(case["given"])
    window = velocity_window(kinematics(**given), Twist(), 1.7, given["counts"])
    assert window == pytest.approx(np.array(case["expect"]), abs=1e-9)


@cases("trajectory")
def test_trajectories_equal_those_of_dwb(case: dict[str, Any]) -> None:
    given = case["given"]
    base = kinematics(given.get("acceleration", UNLIMITED), given.get("deceleration", -UNLIMITED))
    pose, current = Pose2(*given.get("pose", (0, 0, 0))), Twist(*given.get("current", (0, 0, 0)))
    velocities = np.array([given["velocity"]])
    trajectories = generate_trajectories(
        pose, current, velocities, base, given["seconds"], given["meters"], given["radians"]
    )
    assert trajectories.poses(np.array([0]))[:, 0] == pytest.approx(np.array(case["expect"]), abs=1e-9)


@cases("critics")
def test_critic_scores_equal_those_of_dwb(case: dict[str, Any]) -> None:
    given, expect = case["given"], dict(case["expect"])
    costs = np.zeros((10, 10), np.uint8)
    if "cost" in given:
        row, column, cost = given["cost"]
        costs[row, column] = cost
    if "unknown_from" in given:
        costs[:, given["unknown_from"] :] = 255
    view = CostmapView(costs, np.full((10, 10), 9.0, np.float32), 0.1, (0.0, 0.0))
    columns = np.arange(given.get("goal_column", 9) + 1)
    plan = np.column_stack((0.05 + 0.1 * columns, np.full(len(columns), 0.05 + 0.1 * given["plan_row"])))
    pose, goal = Pose2(*given.get("pose", (0.05, 0.55, 0.0))), Pose2(*plan[-1].tolist())
    spec = Spec(type="dwb", **given.get("options", {}))
    scores = score_trajectories(spec, view, pose, goal, plan, np.array([given["velocity"]]), np.array([given["end"]]))
    assert bool(scores.legal[0]) is expect.pop("legal", True)
    if "total" in expect:
        assert scores.total[0] == pytest.approx(expect.pop("total"), abs=1e-9)
    assert {name: scores.raw[name][0] for name in expect} == pytest.approx(expect, abs=1e-9)


@cases("rotate")
def test_rotate_to_goal_critic_scores_stopping_and_turning(case: dict[str, Any]) -> None:
    given, expect = case["given"], case["expect"]
    critic = RotateToGoalCritic(stopped_velocity=0.25, slowing_factor=5.0)
    scores, legal = critic.scores(
        Twist(*given["current"]), given["goal_yaw"], np.array(given["velocities"]), np.array(given["end_yaws"])
    )
    assert scores == pytest.approx(expect["scores"], abs=1e-9)
    assert legal.tolist() == expect["legal"]


@cases("oscillation")
def test_oscillation_critic_forbids_reversals(case: dict[str, Any]) -> None:
    critic = OscillationCritic(0.05, 0.2, 0.05)
    for command, x in zip(case["given"]["commands"], case["given"]["moved"], strict=True):
        critic.record(Pose2(x, 0.0), Twist(*command))
    velocities = {"forward": (0.2, 0, 0), "backward": (-0.2, 0, 0), "left": (0, 0, 0.3), "right": (0, 0, -0.3)}
    legal = dict(zip(velocities, critic.is_legal(np.array(list(velocities.values()))).tolist(), strict=True))
    assert {name: legal[name] for name in case["expect"]} == case["expect"]


def test_turn_at_the_goal_continues_after_a_push() -> None:
    critic = RotateToGoalCritic(0.25, 5.0)
    turn, drive = np.array([[0.0, 0.0, 0.5]]), np.array([[0.3, 0.0, 0.0]])
    critic.scores(Twist(0.1), 0.0, turn, np.zeros(1))
    assert critic.scores(Twist(0.5), 0.0, turn, np.zeros(1))[1].all()
    assert not critic.scores(Twist(0.5), 0.0, drive, np.zeros(1))[1].any()
