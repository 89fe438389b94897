"""Whether several robots start apart from each other."""

from collections.abc import Iterator, Sequence
from itertools import combinations

from simscen.core.problems import Problem
from simscen.run.precheck.scene import Scene
from simscen.worlds.overlap import placed, polygons_overlap


def apart(scenes: Sequence[Scene]) -> Iterator[Problem]:
    """An error for each robot that starts where another one does, told of the later by name."""
    for one, other in combinations(scenes, 2):
        if polygons_overlap(placed(one.outline, one.start), placed(other.outline, other.start)):
            names = f"`{other.loaded.robot_name}` starts in the same place as `{one.loaded.robot_name}`"
            where = f"({other.start.x:g}, {other.start.y:g}) and ({one.start.x:g}, {one.start.y:g})"
            hint = "move one of them by more than the size of both"
            yield other.loaded.problem(("robot", "pose"), "SC044", f"robot {names}: {where}", hint)
