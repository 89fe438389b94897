"""Test of the text of a claim."""

import pytest

from simscen.core.records.study import ClaimResult, ClaimStatus
from simscen.report.study import claim_text


@pytest.mark.parametrize(
    ("method", "needed"),
    [("fixed", "1000 are needed"), ("sprt", "up to 1000 may be needed"), ("anytime", "up to 1000 may be needed")],
)
def test_undecided_claim_states_how_many_runs_may_decide_it(method: str, needed: str) -> None:
    claim = ClaimResult(method, 0.9, 0.95, 1000, ClaimStatus.UNDECIDED, 39, 40)
    assert claim_text(claim).endswith(f"undecided, 39 of 40 runs passed; {needed}")
