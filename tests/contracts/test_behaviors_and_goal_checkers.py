"""Contract tests of all recovery behaviors and goal checkers."""

import pytest

from simscen.advanced.spec import Retrace
from simscen.model.controllers import SimpleGoalChecker
from simscen.model.recovery import BackUp, ClearCostmap, Spin, Wait
from simscen.testing import Promise, promises_of

SPECS = {
    "spin": Spin(),
    "spin clockwise": Spin(spin_dist=-3.0, max_rotational_vel=0.5),
    "wait": Wait(),
    "backup": BackUp(),
    "retrace": Retrace(),
    "clear_costmap": ClearCostmap(),
    "simple": SimpleGoalChecker(),
    "simple, not stateful": SimpleGoalChecker(stateful=False),
}


@pytest.mark.parametrize("promise", [p for name, spec in SPECS.items() for p in promises_of(spec, name)], ids=str)
def test_component_meets_its_contract(promise: Promise) -> None:
    promise.check()
