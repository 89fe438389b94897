"""Whether an answer is one: what a criterion or a metric hands over is looked at before anybody believes it."""

import math
from collections.abc import Sequence

from simscen.core.verdict import Finding, Status

_JUDGED = (Status.PASS, Status.FAIL, Status.INCONCLUSIVE, Status.ERROR)


def flaw_of(findings: object) -> str:
    """Why a criterion's findings are no judgement; "" when they are. A number that is none could pass for a verdict."""
    if not isinstance(findings, Sequence) or not findings:
        return "it checked nothing"
    return next((flaw for finding in findings if (flaw := _flaw(finding))), "")


def _flaw(finding: object) -> str:
    if not isinstance(finding, Finding) or finding.status not in _JUDGED:
        return f"its finding is {type(finding).__name__}, which is none"
    if not all(isinstance(text, str) for text in (finding.what, finding.measured, finding.limit, finding.unit)):
        return "its finding says something that is no text"
    what = finding.what or "its finding"
    for name, number in (("margin", finding.margin), ("value", finding.value)):
        if number is not None and (not isinstance(number, int | float) or math.isnan(number)):
            return f"the {name} of {what} is no number: {number!r}"
    tick: object = finding.tick
    if tick is not None and not isinstance(tick, int):
        return f"the tick of {what} is no int: {tick!r}"
    margin, status = finding.margin, finding.status
    if margin is not None and status in (Status.PASS, Status.FAIL) and (margin < 0) is not (status is Status.FAIL):
        return f"{what} is a {status.value} by a margin of {margin:g}"
    return ""
