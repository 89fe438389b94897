"""The parameters of planners: OMPL's, Nav2's grid planners, and the planner of the advanced stack."""

from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Discriminator, Field, Tag

from simscen.spec.base import Typed
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.lazy_spec import LazySpec
from simscen.spec.quantities import (
    Frequency,
    NonNegativeLength,
)

Iterations = Annotated[int, Field(ge=1, le=1_000_000)]


class PlannerSpec(Typed):
    """The planner of the global path, and when it plans anew."""

    tolerance: NonNegativeLength = 0.5
    """How far from an unreachable goal the plan may end."""
    replanning: Literal["on_invalid", "rate"] = "on_invalid"
    """Replan only if the path becomes invalid, or at a rate; Nav2 has a behavior tree for each. The advanced stack also
    replans `on_invalid` if a clearly better path appears, and if moving obstacles will be in the way."""
    replanning_rate: Frequency | None = None
    """Rate of new plans, or of checks of the current one; default: 1 Hz, through poses 0.333 Hz, as in Nav2's trees."""
    cautious: bool = False
    """Whether paths with more clearance are preferred once a plan could not be followed; the advanced stack does."""


StateSpace = Literal["auto", "holonomic", "se2", "dubins", "reeds_shepp"]


class OmplParameters(PlannerSpec):
    """The parameters of all planners that search with OMPL."""

    allow_unknown: bool = True
    """Whether plans may lead over what is not known, as dear as what is barely free."""
    cost_travel_multiplier: Annotated[float, Field(ge=0, le=100)] = 2.0
    """A meter of way costs 1 + this times its cost / 252 (nav2_smac_planner's name and meaning; its default is 1)."""
    max_iterations: Iterations = 50_000
    """Iterations after which a search fails. There is no limit in seconds, so that results repeat."""
    state_space: StateSpace = "auto"
    """auto: Reeds-Shepp for an Ackermann drive, se2 for a long footprint, otherwise holonomic."""


class OmplPlanner(OmplParameters):
    """A planner of OMPL on the costmap."""

    component: ClassVar[str] = "simscen.stack.planners.build:ompl_planner"
    type: Literal["bit_star", "rrt_connect", "rrt_star", "informed_rrt_star", "aorrtc", "kpiece"] = "bit_star"
    improving_iterations: Iterations = 500
    """Iterations of planners that improve their path; `bit_star` processes two batches of 200 samples instead."""
    simplify: bool = True
    """Whether OMPL shortens the path and moves it to where it costs less."""


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
    return kind if kind in ("navfn", "smac_2d", "medial_axis") else "ompl"


_Planners = Annotated[
    Annotated[OmplPlanner, Tag("ompl")]
    | Annotated[Navfn, Tag("navfn")]
    | Annotated[Smac2d, Tag("smac_2d")]
    | Annotated[PlannerSpec, LazySpec("simscen.advanced.planners.spec", "MedialAxisPlanner"), Tag("medial_axis")],
    Discriminator(_planner),
]


Planner = Annotated[PlannerSpec, ExtensibleUnion("planner", _Planners)]


_HERE = "simscen.model.planners:"
PLANNERS = {
    **dict.fromkeys(get_args(OmplPlanner.model_fields["type"].annotation), _HERE + "OmplPlanner"),
    "navfn": _HERE + "Navfn",
    "smac_2d": _HERE + "Smac2d",
    "medial_axis": "simscen.advanced.planners.spec:MedialAxisPlanner",
}
