"""Bounds on how often something happened."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

from pydantic import Field, model_validator

from simscen.core.events import Event
from simscen.core.verdict import Finding, Status
from simscen.criteria.bounds import counted, undecided
from simscen.criteria.moments import finished
from simscen.spec.base import Spec

if TYPE_CHECKING:
    from simscen.core.trace import Trace

Count = Annotated[int, Field(ge=0, le=100_000)]


class Counts(Spec):
    """At least `min`, at most `max`."""

    min: Count | None = None
    """At least so often."""
    max: Count | None = None
    """At most so often."""

    @model_validator(mode="after")
    def _some_bound(self) -> Counts:
        if self.min is None and self.max is None:
            raise ValueError("expected min or max")
        if self.max is None and self.min == 0:
            raise ValueError("`min: 0` alone always holds; expected a larger min, or max")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"min {self.min} is above max {self.max}, which nothing can be")
        return self

    def bound(self, trace: Trace, what: str, noun: str, hits: Sequence[Event], detail: Sequence[str]) -> list[Finding]:
        """One finding for each bound; in a log that was cut off, too few so far may have become enough."""
        at = (trace, hits[-1].tick) if hits else None
        findings = counted(what, len(hits), noun, self.min, self.max, at=at, detail=detail)
        if self.min is not None and findings[0].status is Status.FAIL and not finished(trace):
            findings[0] = undecided(what, f"{findings[0].measured} so far", findings[0].limit, detail)
        return findings
