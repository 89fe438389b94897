import json

from simscen.cli.bench_run import Localized, Measured
from simscen.cli.bench_table import as_json, as_text
from simscen.study.tally import Row
from simscen.study.versus import Difference, Versus

BARN = Row("BARN", 30, 29 / 30, (0.833, 0.994), 1 / 30, 0.0, 0.0, 0.0, 7.24, 0.476, 1.031, 0.71)
TOUR = Row("localization, tour", 20, 1.0, None, 0.0, 0.0, 0.0, 0.0, 48.8, None, 0.99, 0.625)
KNOWN = Localized(0.0301, 0.0402, {5.0: 0.02, 10.0: 2.5}, (2.02, 4.17))

TABLE = """\
experiment          runs  success  95 % interval  collision  timeout  failed    time  path    SCT  score
BARN                  30    0.967  0.833 … 0.994      0.033    0.000   0.000   7.2 s  1.03  0.710  0.476
localization, tour    20    1.000              -      0.000    0.000   0.000  48.8 s  0.99  0.625      -

localization, tour: 0.030 m RMSE, worst run 0.040 m
  ANEES 0.02 at 5 s, 2.50 at 10 s; a consistent belief lies in 2.02 … 4.17 (95 %)

same drives, with and without  pairs  better  worse                   success  seconds     SCT                     score
BARN                              30       0      3  -0.100 (-0.200 … +0.000)     +1.5  -0.050  -0.020 (-0.030 … -0.010)

BARN's own figures for DWA at 0.5 m/s, in another simulator and all 50 worlds: success 0.850, collisions 0.056, \
timeouts 0.094, score 0.159"""
SLOWER = Versus(
    "BARN",
    30,
    0,
    3,
    Difference(-0.1, (-0.2, 0.0)),
    Difference(1.5, None),
    Difference(-0.05, None),
    Difference(-0.02, (-0.03, -0.01)),
)


def test_below_the_table_stand_beliefs_then_what_a_stack_changes_then_what_others_have_published() -> None:
    assert as_text([Measured(BARN), Measured(TOUR, KNOWN)], [SLOWER]) == TABLE


def test_the_json_holds_every_number() -> None:
    told = json.loads(as_json([Measured(BARN), Measured(TOUR, KNOWN)]))
    assert told["experiments"][0]["tally"]["score"] == 0.476
    assert told["experiments"][1]["localized"]["anees"] == {"5.0": 0.02, "10.0": 2.5}
    assert told["dwa_published"]["success"] == 0.85
