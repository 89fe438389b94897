"""Specification of acceptance claims (`acceptance:`)."""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from simscen.spec.base import Spec
from simscen.spec.quantities import Quantity

MAX_RUNS = 1_000_000
DEFAULT_SEQUENTIAL_FACTOR = 20
"""Default limit of a sequential test, as a multiple of the fewest runs that can show the claim."""

Rate = Annotated[float, Field(gt=0, lt=1), Quantity("ratio")]
Confidence = Annotated[float, Field(ge=0.5, le=0.999999), Quantity("ratio")]


class PassRate(Spec):
    """Claim that the robot passes at least the fraction `min` of all runs, and the statistical test of this claim.

    Example: `pass_rate: {min: 95 %, confidence: 95 %}`
    """

    min: Rate
    """Lowest acceptable pass rate."""
    confidence: Confidence = 0.95
    """Minimum probability that a robot with a pass rate below `min` is not accepted."""
    method: Literal["fixed", "sprt", "anytime"] = "fixed"
    """`fixed`: all `runs`, then the exact Clopper-Pearson limits. `sprt`: the sequential probability ratio test between
    `min` and `target`, which stops as soon as it is decided. `anytime`: a confidence sequence, which may be evaluated
    after each run and stops as soon as it is decided."""
    runs: Annotated[int, Field(ge=1, le=MAX_RUNS)] | None = None
    """Number of runs of `fixed`; for the other methods, the number after which the test ends undecided. Default: the
    fewest runs that show the claim if all pass; for the other methods, 20 times as many."""
    target: Rate | None = None
    """Pass rate of a robot that should be accepted; only for `sprt`."""
    power: Confidence = 0.9
    """Minimum probability that `sprt` does not reject a robot with the pass rate `target`."""

    @property
    def max_runs(self) -> int:
        """Number of runs after which the test ends in any case."""
        if self.runs is not None:
            return self.runs
        fewest = fewest_runs(self.min, self.confidence)
        return fewest if self.method == "fixed" else min(DEFAULT_SEQUENTIAL_FACTOR * fewest, MAX_RUNS)

    @model_validator(mode="after")
    def _check_method(self) -> "PassRate":
        if self.method == "sprt" and self.target is None:
            raise ValueError("`sprt` needs a `target`: the pass rate of a robot that should be accepted")
        if self.method != "sprt":
            for name in ("target", "power"):
                if name in self.model_fields_set:
                    raise ValueError(f"`{name}` is only for `method: sprt`")
        if self.target is not None and self.target <= self.min:
            raise ValueError(f"`target` {self.target:g} must be greater than `min` {self.min:g}")
        if self.runs is None and fewest_runs(self.min, self.confidence) > MAX_RUNS:
            raise ValueError(f"this claim needs more than {MAX_RUNS} runs")
        return self


def fewest_runs(rate: float, confidence: float) -> int:
    """Return the smallest number n of runs that show the pass rate if all pass: 1 - `rate`^n >= `confidence`."""
    runs = math.ceil(math.log1p(-confidence) / math.log(rate) - 1e-9)
    return max(1, runs)


class Acceptance(Spec):
    """Claim about many random runs of a scenario, which `simscen study` tests."""

    pass_rate: PassRate
    """Pass rate over random seeds and, if there are any, over random variations (`sampled`)."""
