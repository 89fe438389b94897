"""Merges the problems of all variations of a scenario. A problem of several variations is reported once."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from simscen.core.errors import Problem
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.tree import Position


class VariationProblems(NamedTuple):
    """Problems of one variation. `varied_paths` are the dotted paths of its values, by their positions in files."""

    name: str
    varied_paths: Mapping[Position, str]
    problems: Sequence[Problem]


def merge_problems(variations: Sequence[VariationProblems]) -> list[Problem]:
    """Return each problem once. Messages state the varied path, and which variations have the problem."""
    if len(variations) == 1 and not variations[0].name:
        return list(dict.fromkeys(variations[0].problems))
    variations_by_problem: dict[Problem, list[VariationProblems]] = {}
    for variation in variations:
        for problem in dict.fromkeys(variation.problems):
            variations_by_problem.setdefault(problem, []).append(variation)
    return sorted(
        _with_variation_names(problem, affected, len(variations)) for problem, affected in variations_by_problem.items()
    )


def _with_variation_names(problem: Problem, affected: Sequence[VariationProblems], variation_count: int) -> Problem:
    """Return a problem with the varied path and the variations with the problem (`affected`) in its message."""
    path = affected[0].varied_paths.get(Position(problem.path, problem.line, problem.col))
    names = [variation.name for variation in affected if variation.name]
    if not names or (path is None and len(names) == variation_count):
        return problem
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    place = "in all variations" if len(names) == variation_count else f"in the variation {quoted(names[0])}{more}"
    return replace(problem, message=f"{problem.message} ({f'{quoted(path)}, ' if path else ''}{place})")
