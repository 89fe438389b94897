"""The same scenario with simscen's own stack as a process of its own."""

import sys
from dataclasses import replace
from pathlib import Path

from simscen.core.external_command import ExternalCommand
from simscen.model.anystack import ExternalStackSpec
from simscen.model.stack import StackSpec
from simscen.model.stackbase import GoalTolerances, StackBase
from simscen.run.prepare import Prepared
from simscen.run.process.confine import environment


def served(prepared: Prepared) -> Prepared:
    """A prepared scenario whose stack, simscen's own, runs behind the stack protocol; of several robots, each one's."""
    if prepared.robots:
        parts = {name: served(part) for name, part in prepared.robots.items()}
        loaded = replace(prepared.loaded, robots={name: part.loaded for name, part in parts.items()})
        return replace(next(iter(parts.values())), loaded=loaded, robots=parts)
    stack = prepared.stack
    assert isinstance(stack, StackSpec)
    written = stack.model_dump_json(by_alias=True, exclude_none=True)
    argv = (sys.executable, "-I", "-m", "simscen.run.external.served", written)
    tolerances = {name: getattr(stack.goal_checker, name) for name in GoalTolerances.model_fields}
    shared = {name: getattr(stack, name) for name in StackBase.model_fields if name != "goal_checker"}
    external = ExternalStackSpec(
        external="reference", ground_truth=stack.told_truth, goal_checker=GoalTolerances(**tolerances), **shared
    )
    runs = ExternalCommand(argv, environment(), str(Path.cwd()))
    return replace(prepared, stack=external, loaded=replace(prepared.loaded, runs=runs))
