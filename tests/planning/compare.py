"""`make planners`: every planner on the same ways; the figures go into docs/reference/planners.md."""

import time
from itertools import pairwise
from pathlib import Path as File

import numpy as np
from grounds import ROBOT, cheapest, forest, maze, pair, rooms, view_of
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
HEAD = """| Planner | Found | Cost: mean, greatest | Length | Least clearance, m | Spread, m | ms: median, greatest |
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


class Way:
    """A way on a ground, with what the cheapest one costs."""

    def __init__(self, view: CostmapView, rng: np.random.Generator) -> None:
        self.view, self.rates = view, TraversalCosts(view, ROBOT, 2.0, True)
        free = np.argwhere(self.rates.free & (view.distance < 0.6))
        inside = Pose2(*((free[len(free) // 2][::-1] + 0.5) * view.resolution + view.origin).tolist())
        reachable = find_endpoints(self.rates, inside, inside, 0.5).reachable
        self.start, self.goal = pair(self.rates, reachable, rng)
        self.cost = cheapest(self.rates, self.start, self.goal)
        shortest = TraversalCosts(view, ROBOT, 0.0, True)
        self.length = cheapest(shortest, self.start, self.goal)

    def price(self, points: Array) -> float:
        """What a path costs; where it cuts the corner of a blocked cell by a hair, as much as beside it."""
        steps = np.hypot(*np.diff(points, axis=0).T)
        return float((steps * np.minimum(self.rates.at((points[:-1] + points[1:]) / 2), 3.0)).sum())

    def room(self, points: Array) -> float:
        """The least distance beyond the radius on a path."""
        columns, rows = ((points[:, i] - self.view.origin[i]) / self.view.resolution for i in (0, 1))
        return float(self.view.distance[rows.astype(int), columns.astype(int)].min()) - ROBOT.inscribed_radius


def built(spec: PlannerSpec) -> Planner:
    """The planner of a specification."""
    if isinstance(spec, OmplPlanner):
        return ompl_planner.ompl_planner(spec, setting(ROBOT))
    if isinstance(spec, Navfn):
        return grid_planner.navfn(spec, setting(ROBOT))
    if isinstance(spec, MedialAxisPlanner):
        return medial_axis_planner(spec, setting(ROBOT))
    assert isinstance(spec, Smac2d)
    return grid_planner.smac_2d(spec, setting(ROBOT))


def row(name: str, spec: PlannerSpec, ways: list[Way]) -> str:
    """The line of one planner."""
    cost, length, room, apart, seconds = [], [], [], [], []
    for way in ways:
        paths: list[Path] = []
        for seed in SEEDS:
            planner, begin = built(spec), time.process_time()
            try:
                paths.append(planner.plan(way.view, way.start, way.goal, seed))
            except NavigationFailure:
                continue
            finally:
                seconds.append(time.process_time() - begin)
            cost.append(way.price(paths[-1].points[:, :2]) / way.cost)
            length.append(paths[-1].length() / way.length)
            room.append(way.room(paths[-1].points))
        for one, other in pairwise(paths):
            apart.append(float(cKDTree(one.points[:, :2]).query(other.points[:, :2])[0].mean()))
    ms = 1000 * np.array(seconds)
    return (
        f"| {name} | {len(cost)} of {len(ms)} | {np.mean(cost):.3f}, {max(cost):.2f} | {np.mean(length):.3f} "
        f"| {np.mean(room):.2f} | {np.mean(apart):.2f} | {np.median(ms):.0f}, {ms.max():.0f} |\n"
    )


def main() -> None:
    """Compare, and write the page."""
    ways = []
    for ground in (rooms, forest, maze):
        for number in range(6):
            rng = np.random.default_rng((number, 20))
            ways.append(Way(view_of(*ground(rng)), rng))
    table = HEAD + "".join(row(name, spec, ways) for name, spec in PLANNERS.items())
    print(table)
    before, rest = PAGE.read_text().split(BEGIN)
    PAGE.write_text(before + BEGIN + table + END + rest.split(END)[1])


if __name__ == "__main__":
    main()
