"""Test of shrinking failures that a search found, with the test functions of `search_plants`."""

import statistics
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from search_plants import PLANTS, failure_threshold

from simscen.cli.session.shrinking import CandidateRuns, Failure, Shrinker
from simscen.core.geometry import Array
from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode, child, node_at
from simscen.run.sessions.search import SearchMethod, make_search

NOMINAL = 0.5
MAX_REMAINING_PARAMETERS = {"linear": 8, "region": 3, "product": 4}


class PlantRuns(CandidateRuns):
    """Evaluates a test function instead of running scenarios.

    The parameters are keys of `stack`; a missing parameter has its nominal value.
    """

    def __init__(self, plant: Callable[[Array], Array], threshold: float) -> None:
        self.plant, self.threshold, self.runs, self.known = plant, threshold, 0, dict[tuple[float, ...], RunResult]()

    def results(self, trees: Sequence[MappingNode]) -> list[RunResult | None]:
        return [self.result(values_of(tree)) for tree in trees]

    def result(self, values: tuple[float, ...]) -> RunResult:
        if values not in self.known:
            self.runs += 1
            margin = self.threshold - float(self.plant(np.array(values)))
            status = Status.PASS if margin >= 0 else Status.FAIL
            finding = Finding(status, "plant", "", "", margin=margin)
            outcome = Outcome.PASSED if margin >= 0 else Outcome.FAILED
            verdicts = (Verdict("plant", "plant", "fail", (finding,)),)
            self.known[values] = RunResult(RunKey("a", 1), "a", outcome, verdicts=verdicts)
        return self.known[values]


def values_of(tree: MappingNode) -> tuple[float, ...]:
    stack = child(tree, "stack")
    plain: dict[str, Any] = {} if stack is None else stack.plain
    return tuple(float(plain.get(f"p{number}", NOMINAL)) for number in range(8))


def make_tree(values: Sequence[float]) -> MappingNode:
    lines = [f"  p{number}: {value:.6f}" for number, value in enumerate(values)]
    tree, _ = parse_yaml("\n".join(["stack:", *lines, ""]), "a")
    assert isinstance(tree, MappingNode)
    return tree


def first_failure(plant: Callable[[Array], Array], threshold: float, seed: int) -> tuple[float, ...]:
    search = make_search(SearchMethod.TPE, [0] * 8, seed)
    while True:
        points = search.ask(8)
        margins = [threshold - float(plant(np.array(point))) for point in points]
        if min(margins) < 0:
            return points[int(np.argmin(margins))]
        search.tell(margins)


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", PLANTS)
def test_a_found_failure_is_shrunk_in_sixty_runs(name: str, is_quick: bool) -> None:
    plant = PLANTS[name]
    threshold = failure_threshold(plant)
    run_counts, remaining_counts = [], []
    for seed in range(1, 9 if is_quick else 21):
        found = first_failure(plant, threshold, seed)
        runs = PlantRuns(plant, threshold)
        tree = make_tree(found)
        margin = runs.result(values_of(tree)).verdicts[0].findings[0].margin
        shrinking = Shrinker(runs, Failure("plant", "plant", 0.5 * margin), tree)
        nominal = make_tree([NOMINAL] * 8)
        shrinking.shrink({("stack", f"p{number}"): node_at(nominal, ("stack", f"p{number}")) for number in range(8)})
        assert shrinking.is_complete
        values = values_of(shrinking.tree)
        assert threshold - float(plant(np.array(values))) <= 0.5 * margin
        run_counts.append(runs.runs)
        remaining_counts.append(sum(value != NOMINAL for value in values))
    assert statistics.median(run_counts) <= 60
    assert max(remaining_counts) <= MAX_REMAINING_PARAMETERS[name]
