"""Specifications of planners: OMPL's and Nav2's, and the `medial_axis` planner of the advanced stack."""

from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Discriminator, Field, Tag

from simscen.spec.base import LazySpec, Typed
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.quantities import Frequency, NonNegativeLength, PositiveLength, Quantity

Iterations = Annotated[int, Field(ge=1, le=1_000_000)]


class PlannerSpec(Typed):
    """Base class of planner specifications."""

    tolerance: NonNegativeLength = 0.5
    """Maximum distance between the end of the plan and an unreachable goal."""
    replanning: Literal["on_invalid", "rate"] = "on_invalid"
    """`on_invalid`: replan only if the path becomes invalid; the advanced stack also replans if a clearly better path
    appears, and if moving obstacles will be in the way. `rate`: replan at a fixed rate. Nav2 has a behavior tree for
    each."""
    replanning_rate: Frequency | None = None
    """Rate of new plans, or of checks of the current plan; default: 1 Hz, with navigate_through_poses 0.333 Hz, as in
    Nav2's behavior trees."""
    proximity_threshold: NonNegativeLength = 4.0
    """With `replanning: rate`, a plan that is not blocked is kept once its remaining length is below this value
    (IsGoalNearby in Nav2's behavior trees)."""
    cautious: bool = False
    """Whether to prefer paths with more clearance after the robot failed to follow a plan, as the advanced stack does.
    """


StateSpace = Literal["auto", "holonomic", "se2", "dubins", "reeds_shepp"]


class OmplParameters(PlannerSpec):
    """Parameters of all planners that search with OMPL."""

    allow_unknown: bool = True
    """Whether plans may lead through unknown cells, which cost slightly more than the most expensive free cells."""
    cost_travel_multiplier: Annotated[float, Field(ge=0, le=100)] = 2.0
    """Cost factor: one meter costs 1 + this value · cell cost / 252 (the parameter of nav2_smac_planner; its default is
    1)."""
    max_iterations: Iterations = 50_000
    """Number of iterations after which a search fails. There is no time limit, so that results are reproducible."""
    state_space: StateSpace = "auto"
    """State space of the search. auto: Reeds-Shepp for an Ackermann drive, se2 for a long footprint, otherwise
    holonomic."""
    minimum_turning_radius: PositiveLength | None = None
    """Turning radius of Dubins and Reeds-Shepp paths; default: 1.15 times that of the robot, so that the controller can
    correct to both sides, and at least 0.2 m (nav2_smac_planner's parameter; its default is 0.4 m)."""
    hull_clearance: Annotated[NonNegativeLength, Field(le=1)] = 0.10
    """Clearance of the whole footprint in searches over poses (all state spaces except `holonomic`). If no path has it,
    half of this clearance is tried, then none."""
    cusp_penalty: NonNegativeLength = 1.0
    """Cost, as a length, of each change between forward and backward in searches over poses: a car could drive this far
    while it stops and steers."""
    pose_searches: Annotated[int, Field(ge=1, le=100)] = 6
    """Number of searches over poses, of which the cheapest path is used, because such tree planners make detours."""


class OmplPlanner(OmplParameters):
    """OMPL planner on the costmap."""

    component: ClassVar[str] = "simscen.stack.planners.ompl_planner:ompl_planner"
    type: Literal["bit_star", "rrt_connect", "rrt_star", "informed_rrt_star", "aorrtc", "kpiece"] = "bit_star"
    gap_clearance: Annotated[NonNegativeLength, Field(le=1)] = 0.07
    """Minimum clearance in gaps on both sides of the robot's inscribed circle. Narrower gaps are used only if there is
    no other path. Start and goal may be closer to obstacles. 0 = no minimum."""
    improving_iterations: Iterations = 500
    """Number of iterations of planners that improve their path; `bit_star` has `max_batches` instead."""
    samples_per_batch: Annotated[int, Field(ge=1, le=100_000)] = 200
    """Number of samples per batch; `bit_star` only (OMPL: 100)."""
    max_batches: Annotated[int, Field(ge=1, le=1000)] = 2
    """Number of batches after which a path is good enough; `bit_star` only. OMPL continues until a time limit."""
    rewire_factor: Annotated[float, Field(ge=0.1, le=10)] | None = None
    """Factor on the distance, or on the number of neighbors, up to which samples are connected; `bit_star`, `rrt_star`,
    and `informed_rrt_star` only. Default: 1.3 for `bit_star`, since OMPL's 1.1 makes more detours; otherwise 1.1."""
    range: PositiveLength | None = None
    """Longest motion added to a tree; all planners except `bit_star`. Default: OMPL's default in searches over poses,
    otherwise 1 m, since motions of OMPL's default, a fifth of the map, mostly end in a wall."""
    goal_bias: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 0.05
    """Probability of drawing the goal as a sample; `rrt_star`, `informed_rrt_star`, and `kpiece` only."""
    cost_threshold_ratio: Annotated[float, Field(ge=0, le=1000), Quantity("ratio")] = 1.01
    """The search ends at a path that costs at most this value times the distance to the goal, which is a lower bound of
    its cost (OMPL's cost threshold); `bit_star` and `rrt_star` only. 0 = never."""
    simplify: bool = True
    """Whether OMPL shortens the path and moves it to cells of lower cost."""
    simplify_steps: Annotated[int, Field(ge=2, le=100_000)] = 100
    """Number of attempts of each pass of the simplification (`max_steps` of OMPL's PathSimplifier)."""


class Navfn(PlannerSpec):
    """nav2_navfn_planner: path of lowest cost over the cells of the costmap (Dijkstra)."""

    component: ClassVar[str] = "simscen.stack.planners.grid_planner:navfn"
    type: Literal["navfn"]
    allow_unknown: bool = True
    """Whether plans may lead through unknown cells, which cost slightly more than the most expensive free cells."""


class Smac2d(PlannerSpec):
    """nav2_smac_planner::SmacPlanner2D: path of lowest cost from cell to neighboring cell (A*)."""

    component: ClassVar[str] = "simscen.stack.planners.grid_planner:smac_2d"
    type: Literal["smac_2d"]
    tolerance: NonNegativeLength = 0.125
    """Maximum distance between the end of the plan and an unreachable goal."""
    allow_unknown: bool = True
    """Whether plans may lead through unknown cells, which cost slightly more than the most expensive free cells."""
    cost_travel_multiplier: Annotated[float, Field(ge=0, le=100)] = 1.0
    """Cost factor: one meter costs 1 + this value · cell cost / 252."""
    smooth_path: bool = True
    """Whether to smooth the path, which removes the corners of the cells."""


def _planner_tag(value: Any) -> str | None:
    kind = value.get("type", "bit_star") if isinstance(value, dict) else getattr(value, "type", None)
    return kind if kind in ("navfn", "smac_2d", "medial_axis") else "ompl"


_Planners = Annotated[
    Annotated[OmplPlanner, Tag("ompl")]
    | Annotated[Navfn, Tag("navfn")]
    | Annotated[Smac2d, Tag("smac_2d")]
    | Annotated[PlannerSpec, LazySpec("simscen.advanced.spec", "MedialAxisPlanner"), Tag("medial_axis")],
    Discriminator(_planner_tag),
]


Planner = Annotated[PlannerSpec, ExtensibleUnion("planner", _Planners)]


_MODULE = "simscen.model.planners:"
PLANNERS = {
    **dict.fromkeys(get_args(OmplPlanner.model_fields["type"].annotation), _MODULE + "OmplPlanner"),
    "navfn": _MODULE + "Navfn",
    "smac_2d": _MODULE + "Smac2d",
    "medial_axis": "simscen.advanced.spec:MedialAxisPlanner",
}
"""Specifications of the shipped planners as `module:Class`, by type."""
