"""Contract tests of all controllers."""

import pytest

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.controllers import DynamicWindow, RegulatedPurePursuit
from simscen.model.mppi import Mppi
from simscen.model.stack_base import ControllerSpec
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.testing import Promise, PromiseBroken, promises_of
from simscen.testing.contracts.controller import ControllerContract
from simscen.testing.flatland import round_robot

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


class TurnsClockwise:
    """Controller that drives straight to the goal and turns clockwise to its heading, by more than half a turn."""

    full_speed, local_plan = 0.4, None

    def __init__(self) -> None:
        self.yaws: list[float] = []

    def set_path(self, path: Path) -> None:
        if not len(path.points):
            raise NavigationFailure(ErrorCode.INVALID_PATH, "no points")

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        self.yaws.append(pose.yaw)
        if pose.x < 6.95:
            return Twist(0.3, 0.0, 0.0)
        is_turned = abs(wrap(goal.pose.yaw - pose.yaw)) < 0.05
        return Twist() if is_turned else Twist(0.0, 0.0, -0.5)


def test_direction_of_the_last_turn_does_not_matter() -> None:
    controller = TurnsClockwise()
    contract = ControllerContract(RegulatedPurePursuit(), robot=round_robot())
    contract.build = lambda: controller  # type: ignore[method-assign]
    contract.it_follows_the_path_to_its_end_and_turns_to_the_goals_heading()
    assert max(controller.yaws) > 3.0, "headings are wrapped"


def test_failure_on_a_free_path_breaks_a_promise() -> None:
    class Fails(TurnsClockwise):
        def command(self, *arguments: object) -> Twist:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "no sample is free")

    contract = ControllerContract(RegulatedPurePursuit(), robot=round_robot())
    contract.build = Fails  # type: ignore[method-assign]
    (promise,) = [promise for promise in contract.promises() if promise.name.startswith("it follows the path")]
    with pytest.raises(PromiseBroken, match="fails with NO_VALID_CONTROL: no sample is free"):
        promise.check()
