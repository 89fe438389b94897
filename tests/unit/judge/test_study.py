"""Tests of the evaluation of studies, against scipy and counting by hand."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from scipy import stats

from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult, error_result
from simscen.core.records.study import ClaimStatus, RateRow, Study
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.pass_rate_claims import anytime_limits, clopper_pearson_limits
from simscen.judge.study import StudyPlan, evaluate_study, in_seed_order, value_text
from simscen.judge.study_json import study_data
from simscen.model.acceptance import PassRate


def run(seed: int, passed: bool = True, margins: Mapping[str, Sequence[float | None]] | None = None) -> RunResult:
    """Return a result with a verdict for each criterion, with one finding for each margin in m."""
    verdicts = tuple(
        Verdict(criterion, criterion, "fail", tuple(Finding(Status.PASS, "", "", "", margin, "m") for margin in each))
        for criterion, each in (margins or {}).items()
    )
    return RunResult(RunKey("s", seed), "s.yaml", Outcome.PASSED if passed else Outcome.FAILED, verdicts)


def run_with_error(seed: int, by_stack: bool) -> RunResult:
    return error_result(RunKey("s", seed), "s.yaml", RunFailure("crashed", "exited 1", by_stack=by_stack))


def plan_of(values: Sequence[Mapping[str, Any]], **fields: Any) -> StudyPlan:
    """Return the plan of a random study whose run with the seed k has the k-th values."""
    by_run = {RunKey("s", seed): each for seed, each in enumerate(values, start=1)}
    return StudyPlan("s", **{"is_random": True, "values": by_run, **fields})


def study_of(path: str, values: Sequence[Any], margins: Sequence[float], **fields: Any) -> Study:
    runs = [run(seed, margin > 0, {"clearance": [margin]}) for seed, margin in enumerate(margins, start=1)]
    return evaluate_study(plan_of([{path: value} for value in values], **fields), runs)


def test_a_crash_of_the_stack_counts_as_a_failure_and_any_other_error_does_not_count() -> None:
    study = evaluate_study(
        plan_of([]), [run(1), run(2, False), run(3), run_with_error(4, True), run_with_error(5, False)]
    )
    assert (study.scenario, study.passed, study.failed, study.errors) == ("s", 2, 2, 1)


def test_limits_of_a_fixed_number_of_runs_equal_those_of_wilson() -> None:
    study = evaluate_study(plan_of([]), [run(seed, seed > 3) for seed in range(1, 21)])
    interval = stats.binomtest(17, 20).proportion_ci(0.95, "wilson")
    assert study.limits == pytest.approx((interval.low, interval.high), abs=1e-6)


@pytest.mark.parametrize(
    "fields",
    [
        {"stops_early": True},
        {"claim": PassRate(min=0.5, method="anytime")},
        {"claim": PassRate(min=0.5, method="sprt", target=0.9)},
        {"claim": PassRate(min=0.5), "stops_early": True},
    ],
)
def test_study_that_may_stop_early_has_anytime_valid_limits(fields: Any) -> None:
    study = evaluate_study(plan_of([{"x": 1}] * 20, **fields), [run(seed, seed > 3) for seed in range(1, 21)])
    assert study.limits == anytime_limits(17, 20, 0.95)
    assert [row.limits for row in study.rates] == [None]


def test_runs_without_random_sampling_have_no_limits() -> None:
    study = evaluate_study(plan_of([{"x": 1}], is_random=False), [run(1)])
    assert study.limits is None
    assert study.rates == (RateRow("x", "1", 1, 1, None),)
    assert evaluate_study(plan_of([]), [run_with_error(1, False)]).limits is None


def test_claim_is_evaluated_in_the_order_of_the_seeds() -> None:
    claim = PassRate(min=0.5, confidence=0.9, method="anytime")
    runs = [run(seed) for seed in range(1, 11)] + [run(seed, False) for seed in range(11, 41)]
    study = evaluate_study(plan_of([], claim=claim), runs[::-1])
    assert study == evaluate_study(plan_of([], claim=claim), runs)
    assert study.claim is not None
    assert (study.claim.status, study.claim.passed, study.claim.runs) == (
        ClaimStatus.HELD,
        7,
        7,
    )  # 8 / 2^7 ≤ 0.1 < 7 / 2^6
    assert evaluate_study(plan_of([]), runs).claim is None


def test_results_are_ordered_by_seed_then_variation() -> None:
    keys = [RunKey("s", 2, "a"), RunKey("s", 1, "b"), RunKey("s", 1, "a")]
    ordered = in_seed_order(RunResult(key, "s.yaml", Outcome.PASSED) for key in keys)
    assert [(result.key.seed, result.key.variation) for result in ordered] == [(1, "a"), (1, "b"), (2, "a")]


def test_the_worst_margin_of_each_criterion_is_the_smallest_of_all_runs_and_findings() -> None:
    study = evaluate_study(
        plan_of([]),
        [
            run(1, margins={"speed": [0.5, 0.2], "clearance": [0.9, -math.inf], "collisions": [None, math.inf]}),
            run(2, margins={"speed": [0.3], "clearance": [0.4, None]}),
            run(3, margins={"speed": [0.2], "clearance": [0.4]}),
        ],
    )
    assert list(study.worst.items()) == [
        ("clearance", (RunKey("s", 2), 0.4, "m")),
        ("speed", (RunKey("s", 1), 0.2, "m")),
    ]


def test_rates_by_value_are_sorted_numerically() -> None:
    values = ["5 cm", "1 m", 0.2, "5 cm", "wide", None, "1 m", 0.2]
    study = study_of("gap", values, [-1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0])
    assert [(row.path, row.value, row.passed, row.runs) for row in study.rates] == [
        ("gap", "5 cm", 1, 2),
        ("gap", "0.2", 0, 2),
        ("gap", "1 m", 2, 2),
        ("gap", "unchanged", 0, 1),
        ("gap", "wide", 1, 1),
    ]
    interval = stats.binomtest(1, 2).proportion_ci(0.95, "wilson")
    assert study.rates[0].limits == pytest.approx((interval.low, interval.high), abs=1e-6)


def test_more_than_ten_values_are_grouped_into_four_ranges() -> None:
    ten = study_of("gap", [0.1 * k for k in range(10)], [1.0] * 10)
    assert len(ten.rates) == 10
    values = [f"{k * 1.0001} cm" for k in range(11, 0, -1)]
    eleven = study_of("gap", values, [float(k) - 5.5 for k in range(11, 0, -1)])
    assert [(row.value, row.passed, row.runs) for row in eleven.rates] == [
        ("1 cm … 3 cm", 0, 3),
        ("4 cm … 6 cm", 1, 3),
        ("7 cm … 9 cm", 3, 3),
        ("10 cm … 11 cm", 2, 2),
    ]
    words = study_of("gap", [f"{k}" + "abc" for k in range(11)], [1.0] * 11)
    assert len(words.rates) == 11
    numbers = study_of("gap", [k / 7 for k in range(1, 21)], [1.0] * 20)
    assert [row.value for row in numbers.rates] == [
        "0.143 … 0.714",
        "0.857 … 1.43",
        "1.57 … 2.14",
        "2.29 … 2.86",
    ]
    mixed = study_of("gap", [*range(10), "wide"], [1.0] * 11)
    assert [row.value for row in mixed.rates] == [*map(str, range(10)), "wide"]


def test_rates_are_sorted_by_parameter_name() -> None:
    names = [f"events.{name}.at" for name in "hgfedcba"]
    study = evaluate_study(plan_of([dict.fromkeys(names, 1)]), [run(1)])
    assert [row.path for row in study.rates] == sorted(names)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "unchanged"),
        (True, "true"),
        (False, "false"),
        (1 / 3, "0.333333"),
        (3, "3"),
        ("0.5 m", "0.5 m"),
        ({"x": 1, "y": [True, None]}, "x: 1, y: true, unchanged"),
    ],
)
def test_values_are_formatted_in_one_line(value: Any, text: str) -> None:
    assert value_text(value) == text


def test_effect_of_a_number_equals_the_rank_correlation_of_scipy() -> None:
    rng = np.random.default_rng(1)
    gaps = rng.uniform(0.1, 2.0, 30)
    margins = (gaps**3 + rng.normal(0.0, 1.0, 30)).tolist()
    study = study_of("gap", [f"{gap * 100!r} cm" for gap in gaps.tolist()], margins)
    expected = stats.spearmanr(gaps, margins)
    (effect,) = study.effects
    assert (effect.path, effect.criterion, effect.runs, effect.is_ordered) == ("gap", "clearance", 30, True)
    assert (effect.effect, effect.p) == pytest.approx((expected.statistic, expected.pvalue), rel=1e-9)


def test_effect_of_a_category_is_epsilon_squared_of_kruskal_wallis() -> None:
    words = ["oak", "pine", "ash"] * 5
    margins = [float(word == "ash") + 0.01 * k for k, word in enumerate(words)]
    groups = [[margin for word, margin in zip(words, margins, strict=True) if word == one] for one in set(words)]
    expected = stats.kruskal(*groups)
    (effect,) = study_of("floor", words, margins).effects
    assert (effect.effect, effect.p) == pytest.approx((expected.statistic / 14, expected.pvalue), rel=1e-9)
    assert (effect.runs, effect.is_ordered) == (15, False)
    switched = study_of("floor", [word == "ash" for word in words], margins)
    assert not switched.effects[0].is_ordered


def test_effects_are_corrected_for_their_number_and_the_strongest_is_first() -> None:
    rng = np.random.default_rng(2)
    draws = rng.uniform(0.0, 1.0, (20, 3))
    margins = [(a + 0.3 * b, -a) for a, b, _ in draws]
    runs = [run(k + 1, margins={"clearance": [one], "speed": [two]}) for k, (one, two) in enumerate(margins)]
    study = evaluate_study(plan_of([dict(zip("abc", row.tolist(), strict=True)) for row in draws]), runs)
    p = {
        (path, criterion): float(stats.spearmanr(draws[:, "abc".index(path)], [pair[k] for pair in margins]).pvalue)
        for path in "abc"
        for k, criterion in enumerate(("clearance", "speed"))
    }
    found = [(effect.path, effect.criterion) for effect in study.effects]
    assert sorted(found) == sorted(p)
    assert found[:2] == [("a", "speed"), ("a", "clearance")]
    largest = 0.0
    for rank, name in enumerate(sorted(p, key=p.__getitem__)):  # Holm, step by step
        largest = max(largest, min(1.0, (6 - rank) * p[name]))
        assert study.effects[found.index(name)].p == pytest.approx(largest, rel=1e-9)
    strength = [(effect.p, -abs(effect.effect)) for effect in study.effects]
    assert strength == sorted(strength)


@pytest.mark.parametrize(
    ("values", "margins"),
    [
        (range(7), range(7)),
        ([1] * 8, range(8)),
        (["1 m", "100 cm"] * 4, range(8)),
        (range(8), [1.0] * 8),
        (["a", "b", "c", "d", "a", "b", "c", "d"], range(8)),
    ],
    ids=["seven runs", "one value", "one value with two units", "one margin", "a value for every two runs"],
)
def test_effect_needs_enough_runs_and_differences(values: Sequence[Any], margins: Sequence[float]) -> None:
    assert study_of("x", list(values), [float(margin) for margin in margins]).effects == ()


def test_eight_runs_and_three_groups_are_enough_for_an_effect() -> None:
    assert len(study_of("x", list(range(8)), [float(k) for k in range(8)]).effects) == 1
    assert len(study_of("x", list("abcabcab"), [float(k) for k in range(8)]).effects) == 1


def test_two_different_numbers_are_enough_for_an_effect() -> None:
    (effect,) = study_of("x", ["1 m", "2 m"] * 4, [0.1, 0.2] * 4).effects
    assert (effect.effect, effect.is_ordered) == (pytest.approx(1.0), True)
    assert len(study_of("x", list(range(8)), [0.0, 1.0] * 4).effects) == 1


def test_only_runs_with_a_margin_count_for_an_effect() -> None:
    runs = [run(k, margins={"clearance": [float(k)]} if k > 2 else {}) for k in range(1, 13)]
    study = evaluate_study(plan_of([{"x": float(k % 5)} for k in range(1, 13)]), runs)
    assert [effect.runs for effect in study.effects] == [10]
    expected = stats.spearmanr([k % 5 for k in range(3, 13)], range(3, 13))
    assert study.effects[0].effect == pytest.approx(expected.statistic)


def test_coverage_is_the_share_of_pairs_of_values_that_occurred() -> None:
    values = [{"a": a, "b": b, "c": c} for a, b, c in [(1, 1, 1), (1, 2, 2), (2, 1, 2), (2, 2, 3)]]
    plan = plan_of(values, is_random=False, is_designed_in_pairs=True)
    all_runs = [run(seed) for seed in range(1, 5)]
    pairs = 2 * 2 + 2 * 3 + 2 * 3
    assert evaluate_study(plan, all_runs).coverage == (4 + 4 + 4) / pairs
    assert evaluate_study(plan, all_runs[:2]).coverage == (2 + 2 + 2) / pairs
    assert evaluate_study(plan, [*all_runs[:2], run_with_error(3, False)]).coverage == 6 / pairs
    assert evaluate_study(plan_of(values), all_runs).coverage is None
    two = plan_of([{"a": 1, "b": 1}, {"a": 2, "b": 2}], is_designed_in_pairs=True)
    assert evaluate_study(two, [run(1), run(2)]).coverage == 0.5
    one = plan_of([{"a": 1}, {"a": 2}], is_designed_in_pairs=True)
    assert evaluate_study(one, [run(1), run(2)]).coverage is None


def test_study_has_the_share_of_accepted_draws_and_values_of_finished_runs() -> None:
    values = [{"a": 1}, {"a": 2}, {"a": 3}]
    study = evaluate_study(plan_of(values, drawn=8), [run(1), run(2)])
    assert study.accepted == 0.25
    assert study.values == {RunKey("s", 1): {"a": 1}, RunKey("s", 2): {"a": 2}}
    assert evaluate_study(plan_of(values), [run(1)]).accepted is None


def test_study_is_converted_to_plain_data() -> None:
    claim = PassRate(min=0.5, confidence=0.9, method="sprt", target=0.8, runs=30)
    runs = [run(seed, seed != 3, {"clearance": [0.1 * seed]}) for seed in range(1, 9)]
    values = [{"gap": float(seed), "floor": "oak" if seed < 5 else "ash"} for seed in range(1, 9)]
    study = evaluate_study(plan_of(values, claim=claim, drawn=10), [*runs, run_with_error(9, False)])
    data = study_data(study)
    assert study.claim is not None
    assert study.limits is not None
    assert data["claim"] == {
        "status": study.claim.status.value,
        "min": 0.5,
        "confidence": 0.9,
        "method": "sprt",
        "target": 0.8,
        "power": 0.9,
        "passed": study.claim.passed,
        "runs": study.claim.runs,
        "max_runs": 30,
        "errors": 1,
        "limits": None,
    }
    assert (data["scenario"], data["sampling"], data["passed"], data["failed"], data["errors"]) == (
        "s",
        "random",
        7,
        1,
        1,
    )
    assert data["interval"] == list(study.limits)
    assert data["rates"][0] == {"path": "floor", "value": "ash", "passed": 4, "runs": 4, "interval": None}
    assert {row["measure"]: row["path"] for row in data["effects"]} == {"spearman": "gap", "epsilon_squared": "floor"}
    gap = data["effects"][0]
    assert (gap["criterion"], gap["effect"], gap["p"], gap["runs"]) == ("clearance", pytest.approx(1.0), 0.0, 8)
    assert data["worst"] == {"clearance": {"variation": "", "seed": 1, "margin": 0.1, "unit": "m"}}
    assert (data["pair_coverage"], data["accepted"]) == (None, 0.9)
    assert data["values"][0] == {"variation": "", "seed": 1, "stack_name": "", "values": {"gap": 1.0, "floor": "oak"}}
    designed = study_data(evaluate_study(plan_of([{"gap": 1.0}], is_random=False), runs[:1]))
    assert (designed["sampling"], designed["claim"], designed["interval"]) == ("designed", None, None)
    fixed = study_data(evaluate_study(plan_of([], claim=PassRate(min=0.5, confidence=0.9)), runs))
    assert (fixed["claim"]["passed"], fixed["claim"]["runs"], fixed["claim"]["power"]) == (3, 4, None)
    assert fixed["claim"]["limits"] == list(clopper_pearson_limits(3, 4, 0.9))


def test_values_are_listed_by_variation_then_seed() -> None:
    keys = [RunKey("s", seed, variation) for seed in (1, 2) for variation in ("wide", "narrow")]
    plan = StudyPlan("s", is_random=True, values={key: {"gap": key.variation} for key in keys})
    data = study_data(evaluate_study(plan, [RunResult(key, "s.yaml", Outcome.PASSED) for key in keys]))
    listed = [(row["variation"], row["seed"]) for row in data["values"]]
    assert listed == [("narrow", 1), ("narrow", 2), ("wide", 1), ("wide", 2)]
