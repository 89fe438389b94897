import json

from simscen.cli.bench_run import Localized, Measured
from simscen.cli.bench_table import as_json, as_text
from simscen.study.tally import Row

BARN = Row("BARN", 30, 29 / 30, (0.833, 0.994), 1 / 30, 0.0, 0.0, 0.0, 7.24, 0.476, 1.031)
TOUR = Row("localization, tour", 20, 1.0, (0.839, 1.0), 0.0, 0.0, 0.0, 0.0, 48.8, None, 0.99)
KNOWN = Localized(0.0301, 0.0402, {5.0: 0.02, 10.0: 2.5}, (2.02, 4.17))

TABLE = """\
experiment          runs  success  95 % interval  collision  timeout  failed    time  score  path
BARN                  30    0.967  0.833 … 0.994      0.033    0.000   0.000   7.2 s  0.476  1.03
  DWA, published     500    0.850                     0.056    0.094                  0.159
localization, tour    20    1.000  0.839 … 1.000      0.000    0.000   0.000  48.8 s      -  0.99

localization, tour: 0.030 m RMSE, worst run 0.040 m
  ANEES 0.02 at 5 s, 2.50 at 10 s; a consistent belief lies in 2.02 … 4.17 (95 %)"""


def test_the_table_shows_dwa_below_barn_and_the_belief_below_all() -> None:
    assert as_text([Measured(BARN), Measured(TOUR, KNOWN)]) == TABLE


def test_the_json_holds_every_number() -> None:
    told = json.loads(as_json([Measured(BARN), Measured(TOUR, KNOWN)]))
    assert told["experiments"][0]["tally"]["score"] == 0.476
    assert told["experiments"][1]["localized"]["anees"] == {"5.0": 0.02, "10.0": 2.5}
    assert told["dwa_published"]["success"] == 0.85
