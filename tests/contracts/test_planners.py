"""Contract tests of all planners, in every state space that fits a robot."""

from typing import get_args

import numpy as np
import pytest

from simscen.model.planners import Navfn, Smac2d
from simscen.model.planners import OmplPlanner as Spec
from simscen.stack.protocols import RobotModel
from simscen.testing import Promise
from simscen.testing.contracts.planner import PlannerContract
from simscen.testing.flatland import box_robot, round_robot

CAR = RobotModel(box_robot(0.6, 0.4).footprint, None, 1.0, 1.0, 0.0, 1.5, 2.0, 2.0, 3.0, turning_radius=0.6)
SPECS = {
    **{
        kind: (Spec(type=kind, max_iterations=5000, improving_iterations=200), round_robot())
        for kind in get_args(Spec.model_fields["type"].annotation)
    },
    "navfn": (Navfn(type="navfn"), round_robot()),
    "smac_2d": (Smac2d(type="smac_2d"), round_robot()),
    "long robot": (Spec(), box_robot()),
    "se2": (Spec(state_space="se2"), box_robot(0.9, 0.3)),
    "reeds_shepp": (Spec(), CAR),
    "dubins": (Spec(state_space="dubins"), CAR),
}
PROMISES = [
    promise for name, (spec, robot) in SPECS.items() for promise in PlannerContract(spec, name, robot=robot).promises()
]


@pytest.mark.sample(24)
@pytest.mark.parametrize("promise", PROMISES, ids=str)
def test_component_meets_its_contract(promise: Promise) -> None:
    promise.check()


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", ["bit_star", "aorrtc", "rrt_star", "kpiece"])
@pytest.mark.parametrize("space", ["reeds_shepp", "dubins"])
def test_path_of_a_car_keeps_its_turning_radius(space: str, kind: str) -> None:
    """This includes poses at which the direction of travel changes."""
    contract = PlannerContract(
        Spec(type=kind, state_space=space, max_iterations=2000, improving_iterations=100), robot=CAR
    )
    for seed in (1, 2, 3):
        points = contract.plan(contract.build(), contract.view(), seed)
        step = np.hypot(*np.diff(points[:, :2], axis=0).T)
        turn = np.abs((np.diff(points[:, 2]) + np.pi) % (2 * np.pi) - np.pi)
        assert (turn <= step / CAR.turning_radius + 1e-3).all()
        moving = step > 1e-3
        heading = np.arctan2(*np.diff(points[:, :2], axis=0).T[::-1])
        deviation = np.abs((heading - points[:-1, 2] + np.pi) % (2 * np.pi) - np.pi)
        is_along = deviation < 0.1 if space == "dubins" else (deviation < 0.1) | (deviation > np.pi - 0.1)
        assert is_along[moving].all()
