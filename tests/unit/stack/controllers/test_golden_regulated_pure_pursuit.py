"""Tests of regulated pure pursuit against golden/regulated_pure_pursuit.yaml, computed by hand from Nav2's formulas."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode
from simscen.core.messages.navigation import Path as Plan
from simscen.model.controllers import RegulatedPurePursuit as Spec
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.protocols import NavigationFailure, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot, setting

CASES = yaml.safe_load((Path(__file__).parent / "golden/regulated_pure_pursuit.yaml").read_text(encoding="utf-8"))
NAV2_OPTIONS = {"use_velocity_scaled_lookahead_dist": False, "slow_down_ahead": False}


@pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])
def test_commands_match_the_formulas(case: dict[str, Any]) -> None:
    robot = round_robot(**{"speed": 1.0, **case.get("robot", {})})
    controller = RegulatedPurePursuit(Spec(**{**NAV2_OPTIONS, **case.get("options", {})}), setting(robot))
    points = np.array(case["path"], dtype=np.float64)
    headings = np.arctan2(*np.diff(points, axis=0)[:, ::-1].T)
    controller.set_path(Plan(np.column_stack((points, np.append(headings, headings[-1])))))
    controller.set_speed_limit(case.get("limit"))
    grid = Flatland([tuple(box) for box in case.get("boxes", [])]).grid((-4.0, -4.0, 5.0, 4.0))
    view = LayeredCostmap(CostmapSpec(), Surroundings(robot, grid, TICK_RATE_HZ)).view
    pose, twist = Pose2(*case.get("pose", (0.0, 0.0, 0.0))), Twist(*case.get("twist", (0.0, 0.0, 0.0)))
    goal = Goal("g", Pose2(*case.get("goal", (50.0, 0.0, 0.0))))
    expect = case["expect"]
    assert case["origin"]
    if "error" in expect:
        with pytest.raises(NavigationFailure) as failure:
            controller.command(pose, twist, view, goal)
        assert failure.value.code is ErrorCode[expect["error"]]
        return
    command = controller.command(pose, twist, view, goal)
    assert command.vy == 0.0
    if "driving" in expect:
        assert (command.vx != 0.0) is expect["driving"]
        return
    tolerance = expect.get("tolerance", 1e-9)
    assert (command.vx, command.wz) == pytest.approx((expect["vx"], expect["wz"]), abs=tolerance)
