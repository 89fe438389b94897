"""A comparison of stacks as results.json holds it."""

from dataclasses import asdict
from typing import Any

from simscen.core.comparison import Against, Comparison, Difference


def comparison_data(comparison: Comparison) -> dict[str, Any]:
    """As plain data: stacks and scenarios as lists in their order."""
    return {
        "baseline": comparison.baseline,
        "stacks": [
            {"name": name, "given": given, **asdict(comparison.total(name))}
            for name, given in comparison.stacks.items()
        ],
        "scenarios": [
            {"scenario": scenario, "stacks": {name: asdict(one) for name, one in row.items()}}
            for scenario, row in comparison.outcomes.items()
        ],
        "against": [_against_data(one) for one in comparison.against],
    }


def _against_data(against: Against) -> dict[str, Any]:
    return {
        "stack": against.stack,
        "pairs": against.pairs,
        "left_out": {"broken_pairs": against.broken, "runs_without_partner": against.alone},
        "pairs_of_which_one_arrived": against.parted,
        "flips": [asdict(flip) for flip in against.flips],
        "flips_p": against.p,
        "differences": [_difference_data(one) for one in against.differences],
    }


def _difference_data(one: Difference) -> dict[str, Any]:
    return {**asdict(one), "interval": None if one.interval is None else list(one.interval)}
