"""Result of a study: pass rate of many runs of one scenario, the claim about it, and what influences the margins."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from simscen.core.records.run_result import RunKey


class ClaimStatus(str, Enum):
    """Decision on a claim. BLOCKED means that simscen could not complete some runs, which prevents a decision."""

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
        confidence: Probability, for example 0.95, with which a decision that the claim holds must be right.
        max_runs: Maximum number of runs.
        status: Decision on the claim.
        passed: Number of passed runs among `runs`.
        runs: Number of runs that decide the claim.
        errors: Number of runs that could not be completed.
        limits: Lower and upper confidence limit of the pass rate. Each limit is valid with the probability
            `confidence`; for the method `anytime`, both are valid at once with this probability. None for `sprt`, which
            has no valid limits, and before the first run.
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
    """Pass rate of the runs in which a parameter has one value or lies in one range of values.

    `path` is the YAML path of the parameter, and `value` is the value or range as text. `limits` are those of the 95 %
    confidence interval; None if the runs are not random.
    """

    path: str
    value: str
    passed: int
    runs: int
    limits: tuple[float, float] | None


@dataclass(frozen=True)
class ParameterEffect:
    """Association of a parameter with the margin of a criterion over `runs`.

    `path` is the YAML path of the parameter. `is_ordered` is True if its values are numbers. `effect` is then
    Spearman's rank correlation, from -1 to 1: negative if the margin falls as the value rises. For other values,
    `effect` is epsilon squared of the Kruskal-Wallis test, from 0 to 1. `p` is the p-value, adjusted for the number of
    tests (Holm).
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
        passed: Number of runs that passed.
        failed: Number of runs that failed. A stack that crashes or does not answer counts as failed.
        errors: Number of runs that simscen could not complete.
        claim: Result of the claim under `acceptance`; None if the scenario has none.
        limits: 95 % confidence limits of the pass rate; None if the runs are not random.
        rates: Pass rate by value of each varied parameter.
        effects: Association of parameters with margins, strongest first.
        worst: Smallest margin of each criterion that has margins: the run, the margin, and its unit.
        values: Values of the varied parameters by run, and by YAML path.
        coverage: Fraction of all pairs of values of two parameters that occurred in a run; None for random values.
        accepted: Fraction of the drawn values that met the condition `require`; None if the scenario has none.
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
