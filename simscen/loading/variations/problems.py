"""Merge the problems of all variations of a scenario: each once, with the variations that have it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from simscen.core.errors import Problem
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.tree import Position


class VariationProblems(NamedTuple):
    """Problems of one variation; `set_by` is the path that set a value, by the position of the value."""

    name: str
    set_by: Mapping[Position, str]
    problems: Sequence[Problem]


def merge_problems(variations: Sequence[VariationProblems]) -> list[Problem]:
    """Return the problems of all variations; those shared by all and not caused by a varied value are not annotated."""
    if len(variations) == 1 and not variations[0].name:
        return list(dict.fromkeys(variations[0].problems))
    having: dict[Problem, list[VariationProblems]] = {}
    for one in variations:
        for problem in dict.fromkeys(one.problems):
            having.setdefault(problem, []).append(one)
    return sorted(_named(problem, those, len(variations)) for problem, those in having.items())


def _named(problem: Problem, having: Sequence[VariationProblems], all_of_them: int) -> Problem:
    path = having[0].set_by.get(Position(problem.path, problem.line, problem.col))
    names = [one.name for one in having if one.name]
    if not names or (path is None and len(names) == all_of_them):
        return problem
    several = f" and {len(names) - 1} more" if len(names) > 1 else ""
    where = "in all variations" if len(names) == all_of_them else f"in the variation {quoted(names[0])}{several}"
    return replace(problem, message=f"{problem.message} ({f'{quoted(path)}, ' if path else ''}{where})")
