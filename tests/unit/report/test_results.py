import json
from dataclasses import replace

from simscen.judge.result_json import from_data
from simscen.report.results import as_document, to_json


def test_every_run_is_in_it_once_with_its_result(passed, failed, crashed):
    document = json.loads(to_json([failed, passed, crashed], "out"))
    assert (document["total"], document["passed"], document["failed"], document["error"]) == (3, 1, 1, 1)
    assert [run["scenario"] for run in document["runs"]] == [
        "evil/[red]::error::x",
        "faults/lidar_off",
        "navigation/goal",
    ]
    assert from_data(document["runs"][1]).verdicts == failed.result.verdicts


def test_the_figures_of_the_session_are_in_it(passed, failed, crashed):
    figures = as_document([passed, failed, crashed])["suite"]
    assert figures["runs"] == 3
    assert figures["measured_runs"] == sum(bool(run.result.metrics) for run in (passed, failed, crashed))
    assert "collisions_per_km" in figures


def test_artifacts_are_relative_to_the_session_so_that_the_folder_may_move(failed):
    (run,) = json.loads(to_json([failed], "out"))["runs"]
    assert run["artifacts"] == {"mcap": "x/run.mcap", "picture": "x/map.png", "result": "x/result.json"}


def test_neither_wall_time_nor_order_shows(passed, failed):
    assert to_json([passed, failed]) == to_json([replace(failed, wall=99.0), passed])
