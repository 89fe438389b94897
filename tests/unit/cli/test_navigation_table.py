"""Tests of the result tables of `simscen bench nav` and `simscen bench localization`."""

import json
from dataclasses import replace

from simscen.bench.localization.campaign import CONSISTENCY_CIRCUMSTANCES, ParameterSetResults, SuccessRate
from simscen.bench.localization.consistency import Consistency
from simscen.bench.navigation.summary import Difference, ExperimentComparison, ExperimentSummary
from simscen.cli.benchmarks.localization import COLUMN_NAMES
from simscen.cli.benchmarks.localization import as_text as localization_text
from simscen.cli.benchmarks.navigation_runs import ExperimentResult, LocalizationAccuracy
from simscen.cli.benchmarks.navigation_table import as_json, as_text

BARN = ExperimentSummary("BARN", 30, 29 / 30, (0.833, 0.994), 1 / 30, 0.0, 0.0, 0.0, 7.24, 0.476, 1.031, 0.71)
TOUR = ExperimentSummary("localization, tour", 20, 1.0, None, 0.0, 0.0, 0.0, 0.0, 48.8, None, 0.99, 0.625)
ACCURACY = LocalizationAccuracy(0.0301, 0.0402, {5.0: 0.02, 10.0: 2.5}, {5.0: (2.02, 4.17), 10.0: (2.02, 4.17)})

TABLE = """\
experiment          runs  success  95 % interval  collision  timeout  failed    time  path    SCT  score
BARN                  30    0.967  0.833 … 0.994      0.033    0.000   0.000   7.2 s  1.03  0.710  0.476
localization, tour    20    1.000              -      0.000    0.000   0.000  48.8 s  0.99  0.625      -

localization, tour: 0.030 m RMSE, worst run 0.040 m
  ANEES 0.02 at 5 s, 2.50 at 10 s; 95 % interval of a consistent localizer: 2.02 … 4.17

with minus without --stack  pairs  better  worse                   success  seconds     SCT                     score
BARN                           30       0      3  -0.100 (-0.200 … +0.000)     +1.5  -0.050  -0.020 (-0.030 … -0.010)

published results of BARN for DWA at 0.5 m/s, in another simulator and 50 worlds: success 0.850, collisions 0.056, \
timeouts 0.094, score 0.159"""
COMPARISON = ExperimentComparison(
    "BARN",
    30,
    0,
    3,
    Difference(-0.1, (-0.2, 0.0)),
    Difference(1.5, None),
    Difference(-0.05, None),
    Difference(-0.02, (-0.03, -0.01)),
)


def test_table_is_followed_by_localization_comparison_and_published_figures() -> None:
    assert as_text([ExperimentResult(BARN), ExperimentResult(TOUR, ACCURACY)], [COMPARISON]) == TABLE


def test_intervals_of_the_anees_are_listed_if_they_differ() -> None:
    early_end = replace(ACCURACY, bounds={5.0: (2.02, 4.17), 10.0: (0.22, 9.35)})
    table = as_text([ExperimentResult(TOUR, early_end)])
    assert "2.50 at 10 s; 95 % intervals of a consistent localizer: 2.02 … 4.17, 0.22 … 9.35" in table


def test_runs_that_end_before_all_times_have_no_anees() -> None:
    assert "ANEES" not in as_text([ExperimentResult(TOUR, replace(ACCURACY, anees={}, bounds={}))])


NARROW = """\
experiment
  runs  success  95 % interval  collision  timeout  failed   time  path    SCT  score
BARN
    30    0.967  0.833 … 0.994      0.033    0.000   0.000  7.2 s  1.03  0.710  0.476

with minus without --stack
BARN
  pairs 30  better 0  worse 3  success -0.100 (-0.200 … +0.000)  seconds +1.5
    SCT -0.050  score -0.020 (-0.030 … -0.010)

published results of BARN for DWA at 0.5 m/s, in another simulator and 50 worlds:
  success 0.850, collisions 0.056, timeouts 0.094, score 0.159"""
LONG_NAME = "BARN, regulated pure pursuit at 0.5 m/s, with nav2_params"


def test_lines_fit_a_narrow_terminal_without_splitting_numbers() -> None:
    assert as_text([ExperimentResult(BARN)], [COMPARISON], columns=86) == NARROW
    table = as_text(
        [ExperimentResult(replace(BARN, case=LONG_NAME)), ExperimentResult(TOUR, ACCURACY)], [COMPARISON], columns=80
    )
    assert max(map(len, table.splitlines())) <= 80
    assert as_text([ExperimentResult(BARN)], [COMPARISON], columns=200) == as_text(
        [ExperimentResult(BARN)], [COMPARISON]
    )


def test_json_contains_every_number() -> None:
    output = json.loads(as_json([ExperimentResult(BARN), ExperimentResult(TOUR, ACCURACY)]))
    assert output["experiments"][0]["tally"]["score"] == 0.476
    assert output["experiments"][1]["localized"]["anees"] == {"5.0": 0.02, "10.0": 2.5}
    assert output["dwa_published"]["success"] == 0.85


def test_localization_table_fits_a_narrow_terminal() -> None:
    shares = {name: SuccessRate(9, 10, (0.7, 1.0)) for name in COLUMN_NAMES}
    consistency = dict.fromkeys(CONSISTENCY_CIRCUMSTANCES, Consistency(1.0, (2.1, 4.2), 0.951, (1.0,) * 5, (0.9, 6.34)))
    row = ParameterSetResults("amcl, likelihood_field", shares, 0.029, consistency, 1.5, 189.0)
    lines = localization_text([row], columns=80).splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[:2] == [row.parameters, "  tracked 9 of 10 (0.70 … 1.00)  start unknown 9 of 10 (0.70 … 1.00)"]
    assert localization_text([row]).splitlines()[1].startswith("amcl, likelihood_field  9 of 10 (0.70 … 1.00)  ")
