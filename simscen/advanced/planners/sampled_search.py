"""BIT* on samples that are given instead of drawn."""

import math
from collections.abc import Iterator
from typing import Any

from simscen.core.geometry import Array
from simscen.stack.planners.ompl_search import OmplSearch, Problem, StateValidity, Termination

CHECKS_BEFORE_FIRST_BATCH = 4
"""Evaluations of the termination condition by BIT* before it draws its first batch, and one more."""


class _SampledValidity(StateValidity):
    """Validity of a state that also moves each state that OMPL draws to the next of the samples.

    OMPL's Python bindings (2.0.1) cannot give a planner a sampler of states. BIT* checks the validity of each state
    that it has drawn before it uses the state, and continues with the moved one.
    """

    def __init__(self, problem: Problem, samples: Array) -> None:
        super().__init__(problem.motion)
        self._ends = (problem.start, problem.goal)
        self._left: Iterator[list[float]] = iter(samples.tolist())

    def __call__(self, state: Any) -> bool:
        """Return whether a state is valid: a state that is drawn after the last sample is not."""
        if (state[0], state[1]) in self._ends:
            return super().__call__(state)
        sample = next(self._left, None)
        if sample is None:
            return False
        state[0], state[1] = sample
        return True


class SampledSearch(OmplSearch):
    """One batch of BIT* on `samples` (n, 2), of which two are connected if they are at most `reach` m apart."""

    good_enough_ratio = 0.0  # the batch is always completed

    def __init__(self, problem: Problem, samples: Array, reach: float, seed: int, max_iterations: int) -> None:
        super().__init__("bit_star", problem, seed, max_iterations, 0)
        self._samples, self._reach = samples, reach

    def _make_validity(self) -> StateValidity:
        return _SampledValidity(self.problem, self._samples)

    def _configure(self, planner: Any) -> None:
        planner.setUseKNearest(False)
        planner.setSamplesPerBatch(len(self._samples))
        planner.setRewireFactor(self._reach / _connection_radius(self.problem.bounds, len(self._samples) + 2))

    def _make_termination(self, planner: Any) -> Termination:
        """Stop when BIT* draws its second batch, which is made small during the first."""
        batches, left = planner.numBatches, self.max_iterations

        def should_stop() -> bool:
            nonlocal left
            left -= 1
            if left == self.max_iterations - CHECKS_BEFORE_FIRST_BATCH:
                planner.setSamplesPerBatch(1)
            return left < 0 or batches() > 1

        return should_stop


def _connection_radius(bounds: tuple[float, float, float, float], states: int) -> float:
    """Return the distance in m up to which BIT* connects so many states with a rewire factor of 1 (r of RRG)."""
    area = (bounds[2] - bounds[0]) * (bounds[3] - bounds[1])
    return 2.0 * math.sqrt(1.5 * area / math.pi * math.log(states) / states)
