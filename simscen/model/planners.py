"""Specifications of the planners: OMPL's planners, Nav2's grid planners, and the planner of the advanced stack."""

from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Discriminator, Field, Tag

from simscen.spec.base import LazySpec, Typed
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.quantities import (
    Frequency,
    NonNegativeLength,
    PositiveLength,
    Quantity,
)

Iterations = Annotated[int, Field(ge=1, le=1_000_000)]


class PlannerSpec(Typed):
    """Base class of planner specifications."""

    tolerance: NonNegativeLength = 0.5
    """Maximum distance between the end of the plan and an unreachable goal."""
    replanning: Literal["on_invalid", "rate"] = "on_invalid"
    """Replan only if the path becomes invalid, or at a rate; Nav2 has a behavior tree for each. The advanced stack also
    replans `on_invalid` if a clearly better path appears, and if moving obstacles will be in the way."""
    replanning_rate: Frequency | None = None
    """Rate of new plans, or of checks of the current plan; default: 1 Hz, with navigate_through_poses 0.333 Hz, as in
    Nav2's behavior trees."""
    proximity_threshold: NonNegativeLength = 4.0
    """With `replanning: rate`, a plan that is not blocked is kept once less than this is left of it (IsGoalNearby in
    Nav2's behavior trees)."""
    cautious: bool = False
    """Whether to prefer paths with more clearance after the robot failed to follow a plan, as the advanced stack does.
    """


StateSpace = Literal["auto", "holonomic", "se2", "dubins", "reeds_shepp"]


class OmplParameters(PlannerSpec):
    """Parameters of all planners that search with OMPL."""

    allow_unknown: bool = True
    """Whether plans may lead through unknown cells, at the cost of cells that are only just free."""
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
    """Clearance of the whole footprint on a path of poses. If there is no such path, half of it is tried, then none."""
    cusp_penalty: NonNegativeLength = 1.0
    """Length that each change between forward and backward adds to the cost of a path of poses: a car could drive this
    far while it stops and steers."""
    pose_searches: Annotated[int, Field(ge=1, le=100)] = 6
    """Number of paths of poses that are planned, of which the cheapest is used: tree planners over poses make detours.
    """


class OmplPlanner(OmplParameters):
    """OMPL planner on the costmap."""

    component: ClassVar[str] = "simscen.stack.planners.ompl_planner:ompl_planner"
    type: Literal["bit_star", "rrt_connect", "rrt_star", "informed_rrt_star", "aorrtc", "kpiece"] = "bit_star"
    gap_clearance: Annotated[NonNegativeLength, Field(le=1)] = 0.07
    """Clearance on both sides of the robot's inscribed circle that a gap must have for the plan to lead through it, if
    there is another path, however long. Start and goal themselves may be closer to obstacles. 0 = any gap will do."""
    improving_iterations: Iterations = 500
    """Number of iterations of planners that improve their path; `bit_star` has `max_batches` instead."""
    samples_per_batch: Annotated[int, Field(ge=1, le=100_000)] = 200
    """Number of samples per batch; `bit_star` only (OMPL: 100)."""
    max_batches: Annotated[int, Field(ge=1, le=1000)] = 2
    """Number of batches after which a path is good enough; `bit_star` only. OMPL continues until a time is over."""
    rewire_factor: Annotated[float, Field(ge=0.1, le=10)] | None = None
    """Factor on the distance, or on the number of neighbors, up to which samples are connected; `bit_star`, `rrt_star`,
    and `informed_rrt_star` only. Default: 1.3 for `bit_star`, since OMPL's 1.1 makes more detours; otherwise 1.1."""
    range: PositiveLength | None = None
    """Longest motion added to a tree; all planners except `bit_star`. Default: 1 m in the plane, since the value that
    OMPL chooses, a fifth of the map, mostly ends in a wall; over poses, the value that OMPL chooses."""
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
    """Whether plans may lead through unknown cells, at the cost of cells that are only just free."""


class Smac2d(PlannerSpec):
    """nav2_smac_planner::SmacPlanner2D: path of lowest cost from cell to neighboring cell (A*)."""

    component: ClassVar[str] = "simscen.stack.planners.grid_planner:smac_2d"
    type: Literal["smac_2d"]
    tolerance: NonNegativeLength = 0.125
    """Maximum distance between the end of the plan and an unreachable goal."""
    allow_unknown: bool = True
    """Whether plans may lead through unknown cells, at the cost of cells that are only just free."""
    cost_travel_multiplier: Annotated[float, Field(ge=0, le=100)] = 1.0
    """Cost factor: one meter costs 1 + this value · cell cost / 252."""
    smooth_path: bool = True
    """Whether to smooth the path, which removes the corners of the cells."""


def _planner(value: Any) -> str | None:
    kind = value.get("type", "bit_star") if isinstance(value, dict) else getattr(value, "type", None)
    return kind if kind in ("navfn", "smac_2d", "medial_axis") else "ompl"


_Planners = Annotated[
    Annotated[OmplPlanner, Tag("ompl")]
    | Annotated[Navfn, Tag("navfn")]
    | Annotated[Smac2d, Tag("smac_2d")]
    | Annotated[PlannerSpec, LazySpec("simscen.advanced.spec", "MedialAxisPlanner"), Tag("medial_axis")],
    Discriminator(_planner),
]


Planner = Annotated[PlannerSpec, ExtensibleUnion("planner", _Planners)]


_HERE = "simscen.model.planners:"
PLANNERS = {
    **dict.fromkeys(get_args(OmplPlanner.model_fields["type"].annotation), _HERE + "OmplPlanner"),
    "navfn": _HERE + "Navfn",
    "smac_2d": _HERE + "Smac2d",
    "medial_axis": "simscen.advanced.spec:MedialAxisPlanner",
}
