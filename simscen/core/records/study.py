"""Result of a study: many runs of one scenario, to find out how often and why it fails.

A margin is the distance between the measured value of a criterion and its limit.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from simscen.core.records.run_result import RunKey


class ClaimStatus(str, Enum):
    """Decision on a claim. HELD: the claim is accepted. BLOCKED: runs that were not completed prevent a decision."""

    HELD = "held"
    REFUTED = "refuted"
    UNDECIDED = "undecided"
    BLOCKED = "blocked"


@dataclass(frozen=True)
class ClaimResult:
    """Result of the claim that the pass rate is at least `min_rate`.

    Attributes:
        method: Statistical method that decides the claim.
        min_rate: Claimed minimum of the pass rate.
        confidence: Minimum probability that a robot with a lower pass rate than `min_rate` is not accepted.
        max_runs: Maximum number of runs.
        status: Decision on the claim.
        passed: Number of runs that passed, out of `runs`.
        runs: Number of runs that decide the claim.
        errors: Number of runs that could not be completed.
        limits: Lower and upper confidence limit of the pass rate. Each limit alone holds with the probability
            `confidence`; for the method `anytime`, both limits together do. None for `sprt`, and before the first run.
        target: Pass rate of a robot that `sprt` should accept; None for other methods.
        power: Minimum probability that `sprt` does not reject a robot with the pass rate `target`; None for other
            methods.
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
    """Pass rate of the runs in which a parameter has one value or lies in one range of values.

    `path` is the YAML path of the parameter. `value` is the value or range as text. `limits` is the 95 % confidence
    interval; None if the values are not random, or if the outcomes determine the number of runs.
    """

    path: str
    value: str
    passed: int
    runs: int
    limits: tuple[float, float] | None


@dataclass(frozen=True)
class ParameterEffect:
    """Association of a parameter with the margin of a criterion.

    Attributes:
        path: YAML path of the parameter.
        criterion: ID of the verdict.
        effect: Spearman's rank correlation (-1 to 1) for numbers. Epsilon squared of the Kruskal-Wallis test (0 to 1)
            for other values.
        p: P-value with Holm's adjustment for multiple tests.
        runs: Number of runs.
        is_ordered: Whether the values of the parameter are numbers.
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
        is_random: Whether the values of the parameters were drawn at random, independently for each run.
        passed: Number of runs that passed.
        failed: Number of runs that failed. A run whose stack crashes or does not answer counts as failed.
        errors: Number of runs that simscen could not complete.
        claim: Result of the claim about the pass rate; None if the scenario has no `acceptance`.
        limits: 95 % confidence interval of the pass rate; None if the values are not random, or if all runs are errors.
        rates: Pass rate by value of each varied parameter.
        effects: Association of parameters with margins, strongest first.
        worst: Run with the smallest margin, this margin, and its unit, by criterion.
        values: Values of the varied parameters, by run and then by YAML path.
        coverage: Fraction of all pairs of values of two parameters that occur in a run; None for random values.
        accepted: Fraction of the drawn values that met the condition `require`; None without such a condition.
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
