"""Compare all planners on the same queries, and write the table into docs/reference/planners.md (`make planners`)."""

import time
from itertools import pairwise
from pathlib import Path as File

import numpy as np
from generated_worlds import ROBOT, cheapest_cost, costmap_of, forest, maze, random_query, rooms
from scipy.spatial import cKDTree

from simscen.advanced.planners.medial_axis_planner import medial_axis_planner
from simscen.advanced.spec import MedialAxisPlanner
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Path
from simscen.model.planners import Navfn, OmplPlanner, PlannerSpec, Smac2d
from simscen.stack.planners import grid_planner, ompl_planner
from simscen.stack.planners.endpoints import find_endpoints
from simscen.stack.planners.traversal_costs import TraversalCosts
from simscen.stack.protocols import CostmapView, NavigationFailure, Planner
from simscen.testing.flatland import setting

PAGE = File(__file__).parents[2] / "docs/reference/planners.md"
BEGIN, END = "<!-- figures -->\n", "<!-- end of figures -->"
SEEDS = range(1, 6)
HEADER = """| Planner | Found | Cost: mean, greatest | Length | Least clearance, m | Spread, m | ms: median, greatest |
|---|---|---|---|---|---|---|
"""
PLANNERS: dict[str, PlannerSpec] = {
    "`bit_star`": OmplPlanner(),
    "`bit_star`, `simplify: false`": OmplPlanner(simplify=False),
    "`aorrtc`": OmplPlanner(type="aorrtc"),
    "`rrt_connect`": OmplPlanner(type="rrt_connect"),
    "`rrt_connect`, `simplify: false`": OmplPlanner(type="rrt_connect", simplify=False),
    "`rrt_star`": OmplPlanner(type="rrt_star"),
    "`informed_rrt_star`": OmplPlanner(type="informed_rrt_star"),
    "`kpiece`": OmplPlanner(type="kpiece"),
    "`navfn`": Navfn(type="navfn"),
    "`smac_2d`": Smac2d(type="smac_2d"),
    "`medial_axis` (advanced)": MedialAxisPlanner(type="medial_axis"),
}


class Query:
    """A random start and goal on a costmap, with the cost of the cheapest path and the length of the shortest one."""

    def __init__(self, view: CostmapView, rng: np.random.Generator) -> None:
        self.view, self.rates = view, TraversalCosts(view, ROBOT, 2.0, True)
        free = np.argwhere(self.rates.free & (view.distance < 0.6))
        inside = Pose2(*((free[len(free) // 2][::-1] + 0.5) * view.resolution + view.origin).tolist())
        reachable = find_endpoints(self.rates, inside, inside, 0.5).reachable
        self.start, self.goal = random_query(self.rates, reachable, rng)
        self.cost = cheapest_cost(self.rates, self.start, self.goal)
        shortest = TraversalCosts(view, ROBOT, 0.0, True)
        self.length = cheapest_cost(shortest, self.start, self.goal)

    def path_cost(self, points: Array) -> float:
        """Return the cost of a path (n, 2). A point that just touches a blocked cell costs as much as one beside it."""
        steps = np.hypot(*np.diff(points, axis=0).T)
        return float((steps * np.minimum(self.rates.at((points[:-1] + points[1:]) / 2), 3.0)).sum())

    def min_clearance(self, points: Array) -> float:
        """Return the minimum distance of the robot's edge from obstacles on a path (n, 3), in m."""
        columns, rows = ((points[:, i] - self.view.origin[i]) / self.view.resolution for i in (0, 1))
        return float(self.view.distance[rows.astype(int), columns.astype(int)].min()) - ROBOT.inscribed_radius


def build_planner(spec: PlannerSpec) -> Planner:
    """Return the planner of a specification."""
    if isinstance(spec, OmplPlanner):
        return ompl_planner.ompl_planner(spec, setting(ROBOT))
    if isinstance(spec, Navfn):
        return grid_planner.navfn(spec, setting(ROBOT))
    if isinstance(spec, MedialAxisPlanner):
        return medial_axis_planner(spec, setting(ROBOT))
    assert isinstance(spec, Smac2d)
    return grid_planner.smac_2d(spec, setting(ROBOT))


def table_row(name: str, spec: PlannerSpec, queries: list[Query]) -> str:
    """Plan each query with each of SEEDS, and return the planner's row of the table."""
    cost, length, clearance, spread, seconds = [], [], [], [], []
    for query in queries:
        paths: list[Path] = []
        for seed in SEEDS:
            planner, begin = build_planner(spec), time.process_time()
            try:
                paths.append(planner.plan(query.view, query.start, query.goal, seed))
            except NavigationFailure:
                continue
            finally:
                seconds.append(time.process_time() - begin)
            cost.append(query.path_cost(paths[-1].points[:, :2]) / query.cost)
            length.append(paths[-1].length() / query.length)
            clearance.append(query.min_clearance(paths[-1].points))
        for first, second in pairwise(paths):
            spread.append(float(cKDTree(first.points[:, :2]).query(second.points[:, :2])[0].mean()))
    ms = 1000 * np.array(seconds)
    return (
        f"| {name} | {len(cost)} of {len(ms)} | {np.mean(cost):.3f}, {max(cost):.2f} | {np.mean(length):.3f} "
        f"| {np.mean(clearance):.2f} | {np.mean(spread):.2f} | {np.median(ms):.0f}, {ms.max():.0f} |\n"
    )


def main() -> None:
    """Compare the planners, and write the table."""
    queries = []
    for world in (rooms, forest, maze):
        for number in range(6):
            rng = np.random.default_rng((number, 20))
            queries.append(Query(costmap_of(*world(rng)), rng))
    table = HEADER + "".join(table_row(name, spec, queries) for name, spec in PLANNERS.items())
    print(table)
    before, after = PAGE.read_text().split(BEGIN)
    PAGE.write_text(before + BEGIN + table + END + after.split(END)[1])


if __name__ == "__main__":
    main()
