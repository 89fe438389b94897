"""Search methods of `simscen falsify`, which propose parameter values with which a scenario may fail.

The margin of a run is the smallest distance between a measured value and its limit. It is negative if the run fails.
"""

import math
from collections.abc import Sequence
from enum import Enum
from typing import Any, Protocol

import numpy as np

from simscen.core.errors import UsageError

Point = tuple[float, ...]
"""One value for each parameter, as cumulative probability (0 < p < 1) in the distribution of the parameter."""
STARTUP_POINTS = 16
"""Number of random points at the start of TPE."""


class SearchMethod(str, Enum):
    """Method by which `simscen falsify` chooses values."""

    AUTO = "auto"
    TPE = "tpe"
    SOBOL = "sobol"
    RANDOM = "random"


class Search(Protocol):
    """A search for the smallest margin. Calls of `ask` and `tell` alternate."""

    def ask(self, count: int) -> list[Point]:
        """Return the next `count` points."""
        ...

    def tell(self, margins: Sequence[float]) -> None:
        """Learn from the margins of the runs at the points that the last `ask` returned (nan: unknown)."""
        ...


def make_search(method: SearchMethod, choices: Sequence[int], seed: int) -> Search:
    """Return a search. AUTO is TPE if Optuna is installed, else SOBOL. Raises UsageError for TPE without Optuna.

    `choices` has the number of values of each discrete parameter, and 0 for a continuous parameter.
    """
    if method is SearchMethod.RANDOM:
        return RandomSearch(len(choices), seed)
    if method is SearchMethod.SOBOL:
        return SobolSearch(len(choices), seed)
    try:
        return TpeSearch(choices, seed)
    except ImportError:
        if method is SearchMethod.AUTO:
            return SobolSearch(len(choices), seed)
        raise UsageError("--method tpe needs Optuna; install it with: pip install optuna") from None


class RandomSearch:
    """Independent uniform points."""

    def __init__(self, dimensions: int, seed: int) -> None:
        self._dimensions, self._rng = dimensions, np.random.default_rng(seed)

    def ask(self, count: int) -> list[Point]:
        """Return random points."""
        return [tuple(_clip(u) for u in row) for row in self._rng.random((count, self._dimensions)).tolist()]

    def tell(self, margins: Sequence[float]) -> None:
        """Ignore the margins."""


class SobolSearch:
    """Points of a Sobol sequence with a random shift. They cover the space more evenly than random points."""

    def __init__(self, dimensions: int, seed: int) -> None:
        from scipy.stats.qmc import Sobol  # the import takes half a second

        self._sequence = Sobol(dimensions, scramble=False)
        self._shift = np.random.default_rng(seed).random(dimensions)

    def ask(self, count: int) -> list[Point]:
        """Return the next points of the sequence."""
        rows = (np.concatenate([self._sequence.random(1) for _ in range(count)]) + self._shift) % 1.0
        return [tuple(_clip(u) for u in row) for row in rows.tolist()]

    def tell(self, margins: Sequence[float]) -> None:
        """Ignore the margins."""


class TpeSearch:
    """Optuna's multivariate tree-structured Parzen estimator (Bergstra et al. 2011)."""

    def __init__(self, choices: Sequence[int], seed: int) -> None:
        """Create an empty Optuna study. Raises ImportError if Optuna is not installed."""
        import optuna

        optuna.logging.set_verbosity(optuna.logging.WARNING)
        sampler = optuna.samplers.TPESampler(seed=seed, multivariate=True, n_startup_trials=STARTUP_POINTS)
        self._choices, self._study = choices, optuna.create_study(sampler=sampler)
        self._failed = optuna.trial.TrialState.FAIL
        self._distributions: dict[str, Any] = {
            f"x{index}": optuna.distributions.CategoricalDistribution(tuple(range(count)))
            if count
            else optuna.distributions.FloatDistribution(0.0, 1.0)
            for index, count in enumerate(choices)
        }
        self._trials: list[Any] = []

    def ask(self, count: int) -> list[Point]:
        """Return `count` points where small margins are likely."""
        self._trials = [self._study.ask(self._distributions) for _ in range(count)]
        return [self._point(trial.params) for trial in self._trials]

    def tell(self, margins: Sequence[float]) -> None:
        """Learn from the margins."""
        for trial, margin in zip(self._trials, margins, strict=True):
            if math.isnan(margin):
                self._study.tell(trial, state=self._failed)
            else:
                self._study.tell(trial, margin)

    def _point(self, parameters: dict[str, Any]) -> Point:
        values = (parameters[f"x{index}"] for index in range(len(self._choices)))
        return tuple(
            (value + 0.5) / count if count else _clip(value) for value, count in zip(values, self._choices, strict=True)
        )


def _clip(u: float) -> float:
    """Return the number in the open interval (0, 1) that is closest to `u`."""
    return min(max(u, 2.0**-53), 1 - 2.0**-53)
