"""Critic manager of MPPI: evaluates the enabled critics in order and adds up their costs."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.model.mppi import CriticName, MppiCritic
from simscen.model.mppi import Mppi as MppiSpec
from simscen.stack.controllers.mppi import critics
from simscen.stack.controllers.mppi.critic_data import CriticData, Mask

Floats = npt.NDArray[np.float32]
NAV2_CRITICS: tuple[CriticName, ...] = (
    "ConstraintCritic",
    "CostCritic",
    "GoalCritic",
    "GoalAngleCritic",
    "PathAlignCritic",
    "PathFollowCritic",
    "PathAngleCritic",
    "PreferForwardCritic",
)


class CriticManager:
    """Adds up what the enabled critics of a specification say."""

    def __init__(self, spec: MppiSpec, omni: bool) -> None:
        default = (*NAV2_CRITICS, "TwirlingCritic") if omni else NAV2_CRITICS
        names: tuple[CriticName, ...] = default if spec.critics is None else tuple(spec.critics)
        self._spec = spec
        self._names = [name for name in names if getattr(spec, name).enabled]

    def costs(self, scene: CriticData) -> tuple[Array, bool]:
        """Costs (n,) of the rollouts, and whether all of them hit something."""
        total = np.zeros(scene.rolled.x.shape[1])
        all_hit = False
        for name in self._names:
            said, hit = self._asked(name, scene)
            if said is not None:
                critic: MppiCritic = getattr(self._spec, name)
                total += said.astype(np.float64) ** critic.cost_power
            if hit is not None:
                all_hit = bool(hit.all())
        return total, all_hit

    def _asked(self, name: CriticName, scene: CriticData) -> tuple[Floats | None, Mask | None]:
        spec, length = self._spec, scene.plan.length
        said: Floats | None = None
        match name:
            case "ConstraintCritic":
                said = critics.constraint(spec.ConstraintCritic, scene)
            case "CostCritic":
                return critics.cost(spec.CostCritic, scene)
            case "ObstaclesCritic":
                return critics.obstacles(spec.ObstaclesCritic, scene)
            case "GoalCritic" if length <= spec.GoalCritic.threshold_to_consider:
                said = critics.goal(spec.GoalCritic, scene)
            case "GoalAngleCritic" if length <= spec.GoalAngleCritic.threshold_to_consider:
                said = critics.goal_angle(spec.GoalAngleCritic, scene)
            case "PathAlignCritic" if length >= spec.PathAlignCritic.threshold_to_consider:
                said = critics.path_align(spec.PathAlignCritic, scene)
            case "PathFollowCritic" if length >= spec.PathFollowCritic.threshold_to_consider:
                said = critics.path_follow(spec.PathFollowCritic, scene)
            case "PathAngleCritic" if length >= spec.PathAngleCritic.threshold_to_consider:
                said = critics.path_angle(spec.PathAngleCritic, scene)
            case "PreferForwardCritic" if length >= spec.PreferForwardCritic.threshold_to_consider:
                said = critics.prefer_forward(spec.PreferForwardCritic, scene)
            case "TwirlingCritic" if length >= scene.tolerance:
                said = critics.twirling(spec.TwirlingCritic, scene)
            case "VelocityDeadbandCritic":
                said = critics.velocity_deadband(spec.VelocityDeadbandCritic, scene)
        return said, None
