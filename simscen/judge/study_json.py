"""Conversion of the result of a study to JSON data for results.json."""

from typing import Any

from simscen.core.records.study import Study


def study_data(study: Study) -> dict[str, Any]:
    """Return the result of a study as JSON data. Limits are [lower, upper]."""
    claim = study.claim
    return {
        "scenario": study.scenario,
        "sampling": "random" if study.is_random else "designed",
        "passed": study.passed,
        "failed": study.failed,
        "errors": study.errors,
        "interval": _limits_data(study.limits),
        "claim": None
        if claim is None
        else {
            "status": claim.status.value,
            "min": claim.min_rate,
            "confidence": claim.confidence,
            "method": claim.method,
            "target": claim.target,
            "power": claim.power,
            "passed": claim.passed,
            "runs": claim.runs,
            "max_runs": claim.max_runs,
            "errors": claim.errors,
            "limits": _limits_data(claim.limits),
        },
        "rates": [
            {
                "path": row.path,
                "value": row.value,
                "passed": row.passed,
                "runs": row.runs,
                "interval": _limits_data(row.limits),
            }
            for row in study.rates
        ],
        "effects": [
            {
                "path": one.path,
                "criterion": one.criterion,
                "measure": "spearman" if one.is_ordered else "epsilon_squared",
                "effect": one.effect,
                "p": one.p,
                "runs": one.runs,
            }
            for one in study.effects
        ],
        "worst": {
            criterion: {"variation": key.variation, "seed": key.seed, "margin": margin, "unit": unit}
            for criterion, (key, margin, unit) in study.worst.items()
        },
        "pair_coverage": study.coverage,
        "accepted": study.accepted,
        "values": [
            {"variation": key.variation, "seed": key.seed, "stack_name": key.stack_name, "values": dict(values)}
            for key, values in sorted(study.values.items())
        ],
    }


def _limits_data(limits: tuple[float, float] | None) -> list[float] | None:
    return None if limits is None else list(limits)
