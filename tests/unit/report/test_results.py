"""Tests of results.json."""

import json
from dataclasses import replace

from simscen.judge.result_json import from_data
from simscen.report.results_json import json_parts, results_document


def test_results_contain_each_run_once(passed, failed, crashed):
    document = json.loads("".join(json_parts([failed, passed, crashed], "out")))
    assert (document["total"], document["passed"], document["failed"], document["error"]) == (3, 1, 1, 1)
    assert [run["scenario"] for run in document["runs"]] == [
        "evil/[red]::error::x",
        "faults/lidar_off",
        "navigation/goal",
    ]
    assert from_data(document["runs"][1]).verdicts == failed.result.verdicts


def test_results_contain_the_figures_of_the_session(passed, failed, crashed):
    with_metrics = replace(passed, result=replace(passed.result, metrics={"collisions": 2.0, "path_length": 500.0}))
    figures = results_document([with_metrics, failed, crashed])["suite"]
    assert (figures["runs"], figures["measured_runs"], figures["collisions_per_km"]) == (3, 1, 4.0)


def test_artifact_paths_are_relative_to_the_session_folder(failed):
    (run,) = json.loads("".join(json_parts([failed], "out")))["runs"]
    assert run["artifacts"] == {"mcap": "x/run.mcap", "picture": "x/map.png", "result": "x/result.json"}


def test_results_do_not_depend_on_wall_time_or_order(passed, failed):
    assert "".join(json_parts([passed, failed])) == "".join(json_parts([replace(failed, wall=99.0), passed]))


def test_determinism_runs_do_not_count_as_evidence(passed, failed):
    repetitions = [replace(run, result=replace(run.result, key=run.key.repetition)) for run in (passed, failed)]
    assert results_document([passed, failed, *repetitions])["suite"] == results_document([passed, failed])["suite"]


def test_stacks_are_not_pooled(passed, failed):
    def with_stack(run, stack):
        return replace(run, result=replace(run.result, key=replace(run.key, stack_name=stack)))

    document = results_document([with_stack(passed, "a"), with_stack(passed, "a.again"), with_stack(failed, "b")])
    assert "suite" not in document
    assert document["suites"] == {"a": results_document([passed])["suite"], "b": results_document([failed])["suite"]}
