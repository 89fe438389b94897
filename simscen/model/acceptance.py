"""Specification of claims about the pass rate of a scenario (`acceptance:`)."""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from simscen.spec.base import Spec
from simscen.spec.quantities import Quantity

MAX_RUNS = 1_000_000
"""Maximum number of runs of a study."""
DEFAULT_SEQUENTIAL_FACTOR = 20
"""Default maximum number of runs of a sequential test, as a multiple of `fewest_runs`."""

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
    """`fixed`: the exact Clopper-Pearson limits after all `runs`. `sprt`: the sequential probability ratio test between
    `min` and `target`. `anytime`: a confidence sequence. `sprt` and `anytime` are evaluated after each run. Runs start
    in batches of 32, and the batch in which the claim is decided is completed."""
    runs: Annotated[int, Field(ge=1, le=MAX_RUNS)] | None = None
    """Number of runs of `fixed`, and maximum number of runs of the other methods. Default for `fixed`: the smallest
    number of runs that proves the claim if all pass. For the other methods: 20 times this number, at most 1,000,000."""
    target: Rate | None = None
    """Pass rate of a robot that should be accepted; only for `sprt`."""
    power: Confidence = 0.9
    """Minimum probability that `sprt` does not reject a robot with the pass rate `target`."""

    @property
    def max_runs(self) -> int:
        """Maximum number of runs."""
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
    """Return the smallest number n of runs that proves the pass rate `rate` if all pass: 1 - rate^n >= confidence."""
    # A rounding error must not add a run if the runs prove the rate exactly, as for 1 - 0.8^4 = 0.5904.
    return max(1, math.ceil(math.log1p(-confidence) / math.log(rate) - 1e-9))


class Acceptance(Spec):
    """Claim about many random runs of a scenario. `simscen study` tests it."""

    pass_rate: PassRate
    """Pass rate over random seeds and, if there are any, over random variations (`sampled`)."""
