"""Contract tests of all controllers."""

import pytest

from simscen.model.controllers import DynamicWindow, RegulatedPurePursuit
from simscen.model.mppi import Mppi
from simscen.model.stack_base import ControllerSpec
from simscen.testing import Promise, promises_of

SPECS: dict[str, ControllerSpec] = {
    "regulated_pure_pursuit": RegulatedPurePursuit(),
    "rpp without regulation": RegulatedPurePursuit(
        use_regulated_linear_velocity_scaling=False, use_cost_regulated_linear_velocity_scaling=False,
        use_velocity_scaled_lookahead_dist=False,
    ),
    "dwb": DynamicWindow(type="dwb", vx_samples=10, vtheta_samples=13),
    "mppi": Mppi(type="mppi", batch_size=400),
}  # fmt: skip


@pytest.mark.parametrize("promise", [p for name, spec in SPECS.items() for p in promises_of(spec, name)], ids=str)
def test_component_meets_its_contract(promise: Promise) -> None:
    promise.check()
