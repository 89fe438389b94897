"""Specifications of planners (`planner:`): OMPL planners, and two planners of Nav2."""

from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field

from simscen.spec.base import Typed
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.quantities import Frequency, NonNegativeLength, PositiveLength, Quantity

Iterations = Annotated[int, Field(ge=1, le=1_000_000)]


class PlannerSpec(Typed):
    """Base class of planner specifications."""

    tolerance: NonNegativeLength = 0.5
    """Maximum distance between the end of the plan and an unreachable goal."""
    replanning: Literal["on_invalid", "rate"] = "on_invalid"
    """`rate`: replan at a fixed rate. `on_invalid`: replan only if the path becomes invalid. With `on_invalid`, the
    advanced stack also replans if a clearly better path appears, or if moving obstacles will be in the way."""
    replanning_rate: Frequency | None = None
    """Rate of new plans (`rate`), or of checks whether the plan is still valid (`on_invalid`). Default, as in Nav2: 1
    Hz, or 0.333 Hz with navigate_through_poses. With `on_invalid`, the advanced stack checks after each change of the
    costmap instead."""
    proximity_threshold: NonNegativeLength = 4.0
    """With `replanning: rate`: remaining length of the plan below which the plan is only replaced if it is blocked
    (IsGoalNearby in Nav2's behavior trees)."""
    cautious: bool = False
    """Whether to prefer paths with more clearance after the robot has failed to follow a plan."""


StateSpace = Literal["auto", "holonomic", "se2", "dubins", "reeds_shepp"]


class OmplParameters(PlannerSpec):
    """Base class of the specifications of planners that search with OMPL."""

    allow_unknown: bool = True
    """Whether plans may lead through unknown cells, which cost slightly more than the most expensive free cells."""
    cost_travel_multiplier: Annotated[float, Field(ge=0, le=100)] = 2.0
    """Cost factor: one meter costs 1 + this value · cell cost / 252 (default of nav2_smac_planner: 1)."""
    max_iterations: Iterations = 50_000
    """Number of iterations after which a search fails."""
    state_space: StateSpace = "auto"
    """State space of the search. `auto`: reeds_shepp for an Ackermann drive, se2 for a long footprint, otherwise
    holonomic."""
    minimum_turning_radius: PositiveLength | None = None
    """Turning radius of Dubins and Reeds-Shepp paths. Default: 1.15 times the turning radius of the robot, but at least
    0.2 m (nav2_smac_planner: 0.4 m)."""
    hull_clearance: Annotated[NonNegativeLength, Field(le=1)] = 0.10
    """Clearance of the whole footprint in searches over poses (all state spaces except `holonomic`). If there is no
    path with this clearance, half of it is tried, and then no clearance."""
    cusp_penalty: NonNegativeLength = 1.0
    """Cost, as a length, of each change between forward and backward driving in searches over poses."""
    pose_searches: Annotated[int, Field(ge=1, le=100)] = 6
    """Number of searches over poses. The cheapest of their paths is used."""


class OmplPlanner(OmplParameters):
    """OMPL planner on the costmap."""

    component: ClassVar[str] = "simscen.stack.planners.ompl_planner:ompl_planner"
    type: Literal["bit_star", "rrt_connect", "rrt_star", "informed_rrt_star", "aorrtc", "kpiece"] = "bit_star"
    gap_clearance: Annotated[NonNegativeLength, Field(le=1)] = 0.07
    """Minimum clearance on both sides of the robot's inscribed circle in gaps; 0 = no minimum. Narrower gaps are used
    only if there is no other path. The start and the goal may be closer to obstacles."""
    improving_iterations: Iterations = 500
    """Number of iterations after which planners that improve their path stop. Without a path by then, they stop at
    their first path. No effect on `bit_star` (see `max_batches`)."""
    samples_per_batch: Annotated[int, Field(ge=1, le=100_000)] = 200
    """Number of samples per batch; `bit_star` only (OMPL: 100)."""
    max_batches: Annotated[int, Field(ge=1, le=1000)] = 2
    """Number of batches after which the search ends if it has found a path; `bit_star` only."""
    rewire_factor: Annotated[float, Field(ge=1, le=10)] | None = None
    """OMPL's rewire factor: with a larger value, a sample is connected to more neighbors. `bit_star`, `rrt_star`, and
    `informed_rrt_star` only. Default: 1.3 for `bit_star`, otherwise 1.1 as in OMPL. With less than 1, a search may need
    minutes to find a path."""
    range: PositiveLength | None = None
    """Maximum length of a motion that is added to a tree; all planners except `bit_star`. Default: OMPL's default in
    searches over poses, otherwise 1 m."""
    goal_bias: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 0.05
    """Probability of drawing the goal as a sample; `rrt_star`, `informed_rrt_star`, and `kpiece` only."""
    cost_threshold_ratio: Annotated[float, Field(ge=0, le=1000), Quantity("ratio")] = 1.01
    """OMPL's cost threshold: the search ends when it has found a path that costs at most this value times the distance
    to the goal. 0 = no threshold. `bit_star` and `rrt_star` only."""
    simplify: bool = True
    """Whether OMPL shortens the path and moves it to cells of lower cost."""
    simplify_steps: Annotated[int, Field(ge=2, le=100_000)] = 100
    """Number of attempts per pass of the simplification (`max_steps` of OMPL's PathSimplifier)."""


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


PLANNERS = {
    **dict.fromkeys(get_args(OmplPlanner.model_fields["type"].annotation), "simscen.model.planners:OmplPlanner"),
    "navfn": "simscen.model.planners:Navfn",
    "smac_2d": "simscen.model.planners:Smac2d",
}
"""Specifications of the planners of the reference stack as `module:Class`, by type."""
Planner = Annotated[PlannerSpec, ExtensibleUnion("planner", default="bit_star")]
