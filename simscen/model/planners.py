"""The parameters of planners: OMPL's, and Nav2's grid planners."""

from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Discriminator, Field, Tag, model_validator

from simscen.spec.bytype import ByType
from simscen.spec.component import Typed
from simscen.spec.quantities import (
    Frequency,
    NonNegativeLength,
)

Iterations = Annotated[int, Field(ge=1, le=1_000_000)]


class PlannerSpec(Typed):
    """What finds a way, and when it is asked for another one."""

    tolerance: NonNegativeLength = 0.5
    """How far from an unreachable goal the plan may end."""
    replanning: Literal["on_invalid", "rate"] = "on_invalid"
    """Replan when the plan is blocked or clearly worse than a new one, or at a rate."""
    replanning_rate: Frequency | None = None
    """How often, with `replanning: rate`; default: 1 Hz, through poses 0.333 Hz, as in Nav2's trees."""
    cautious: bool = True
    """Whether, once a plan could not be followed, roomier ways are taken where there are some. Nav2 does not."""


class OmplPlanner(PlannerSpec):
    """A planner of OMPL on the costmap."""

    component: ClassVar[str] = "simscen.stack.planners.build:ompl_planner"
    type: Literal["bit_star", "rrt_connect", "rrt_star", "informed_rrt_star", "aorrtc", "kpiece"] = "bit_star"
    allow_unknown: bool = True
    """Whether plans may lead over what is not known, as dear as what is barely free."""
    cost_travel_multiplier: Annotated[float, Field(ge=0, le=100)] = 2.0
    """A meter of way costs 1 + this times its cost / 252 (nav2_smac_planner's name and meaning; its default is 1)."""
    sampler: Literal["auto", "uniform", "medial_axis", "corridor"] = "auto"
    """Where it searches; auto: medial_axis for bit_star, which alone can, else uniform."""
    max_iterations: Iterations = 50_000
    """Iterations of a search before it is given up; never seconds."""
    improving_iterations: Iterations = 500
    """Iterations of planners that improve their path, when they draw the samples themselves."""
    simplify: bool = True
    """Whether the path that OMPL found is moved to where it costs least, and smoothed."""
    state_space: Literal["auto", "holonomic", "se2", "dubins", "reeds_shepp"] = "auto"
    """auto: Reeds-Shepp for an Ackermann drive, se2 for a long footprint, else holonomic."""

    @model_validator(mode="after")
    def _sampled(self) -> "OmplPlanner":
        if self.sampler == "medial_axis" and self.type != "bit_star":
            raise ValueError(f"`sampler: medial_axis` is for `bit_star`; `{self.type}` draws its samples itself")
        return self


class Navfn(PlannerSpec):
    """nav2_navfn_planner: the cheapest way over the cells of the costmap, by Dijkstra."""

    component: ClassVar[str] = "simscen.stack.planners.grid_planner:navfn"
    type: Literal["navfn"]
    allow_unknown: bool = True
    """Whether plans may lead over what is not known, as dear as what is barely free."""


class Smac2d(PlannerSpec):
    """nav2_smac_planner::SmacPlanner2D: the cheapest way from cell to neighboring cell."""

    component: ClassVar[str] = "simscen.stack.planners.grid_planner:smac_2d"
    type: Literal["smac_2d"]
    tolerance: NonNegativeLength = 0.125
    """How far from an unreachable goal the plan may end."""
    allow_unknown: bool = True
    """Whether plans may lead over what is not known, as dear as what is barely free."""
    cost_travel_multiplier: Annotated[float, Field(ge=0, le=100)] = 1.0
    """A meter of way costs 1 + this times its cost / 252."""
    smooth_path: bool = True
    """Whether the corners of the cells are taken out of the path."""


def _planner(value: Any) -> str | None:
    kind = value.get("type", "bit_star") if isinstance(value, dict) else getattr(value, "type", None)
    return kind if kind in ("navfn", "smac_2d") else "ompl"


_Planners = Annotated[
    Annotated[OmplPlanner, Tag("ompl")] | Annotated[Navfn, Tag("navfn")] | Annotated[Smac2d, Tag("smac_2d")],
    Discriminator(_planner),
]


Planner = Annotated[PlannerSpec, ByType("planner", _Planners)]


_HERE = "simscen.model.planners:"
PLANNERS = {
    **dict.fromkeys(get_args(OmplPlanner.model_fields["type"].annotation), _HERE + "OmplPlanner"),
    "navfn": _HERE + "Navfn",
    "smac_2d": _HERE + "Smac2d",
}
