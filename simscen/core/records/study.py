"""Result of a study: many runs of one scenario, the claim about them, and what influences their margins."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from simscen.core.records.run_result import RunKey


class ClaimStatus(str, Enum):
    """Outcome of a claim. BLOCKED: errors of simscen in some runs prevent a decision."""

    HELD = "held"
    REFUTED = "refuted"
    UNDECIDED = "undecided"
    BLOCKED = "blocked"


@dataclass(frozen=True)
class ClaimResult:
    """Result of the claim that the pass rate is at least `min_rate`.

    Attributes:
        method: Statistical method that decides the claim.
        confidence: Probability, for example 0.95, with which the decision that the claim holds must be right.
        max_runs: Maximum number of runs.
        passed: Number of passed runs among `runs`.
        runs: Number of runs that decide the claim.
        errors: Number of runs that could not be completed.
        limits: Lower and upper confidence limits of the pass rate, each with the probability `confidence`; for the
            method `anytime`, both together. None for `sprt`, which has no valid limits, and before the first run.
        target: Pass rate of a robot that `sprt` should accept; None for other methods.
        power: Minimum probability that `sprt` does not reject such a robot; None for other methods.
    """

    method: str
    min_rate: float
    confidence: float
    max_runs: int
    status: ClaimStatus
    passed: int
    runs: int
    errors: int = 0
    limits: tuple[float, float] | None = None
    target: float | None = None
    power: float | None = None


@dataclass(frozen=True)
class RateRow:
    """Pass rate of the runs in which the parameter `path` has a `value` or is in a range of values.

    `limits` are those of the 95 % interval; None where the runs are not random.
    """

    path: str
    value: str
    passed: int
    runs: int
    limits: tuple[float, float] | None


@dataclass(frozen=True)
class ParameterEffect:
    """Association of a parameter with the margin of a criterion over `runs`.

    `effect` is Spearman's rank correlation for numbers, from -1 to 1: negative if a larger value makes the margin
    smaller. For other values (`is_ordered` False) it is epsilon squared of the Kruskal-Wallis test, from 0 to 1. `p` is
    the p-value, adjusted for the number of tests (Holm).
    """

    path: str
    criterion: str
    effect: float
    p: float
    runs: int
    is_ordered: bool


@dataclass(frozen=True)
class Study:
    """Result of a study.

    Attributes:
        scenario: Id of the scenario.
        is_random: Whether the runs are independent random draws, so that a pass rate has an interval.
        passed: Runs that passed.
        failed: Runs that did not; a stack that crashes or does not answer counts as failed.
        errors: Runs that simscen could not complete.
        claim: Result of `acceptance`, if the scenario has it.
        limits: 95 % confidence interval of the pass rate; None where the runs are not random.
        rates: Pass rate by value of each varied parameter.
        effects: Association of parameters with margins, strongest first.
        worst: Smallest margin of each criterion that has one: its run, and the margin with its unit.
        values: Values of the varied parameters by run.
        coverage: Share of the pairs of values of two parameters that occurred in a run; None for random values.
        accepted: Share of the drawn values that meet `require`; None without it.
    """

    scenario: str
    is_random: bool
    passed: int
    failed: int
    errors: int
    claim: ClaimResult | None
    limits: tuple[float, float] | None
    rates: tuple[RateRow, ...]
    effects: tuple[ParameterEffect, ...]
    worst: Mapping[str, tuple[RunKey, float, str]]
    values: Mapping[RunKey, Mapping[str, Any]]
    coverage: float | None = None
    accepted: float | None = None
