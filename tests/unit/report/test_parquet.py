"""Tests of results as Parquet tables, which pyarrow reads."""

import math
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult, error_result
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.report import parquet

FAILED = Verdict(
    "clearance",
    "near",
    "fail",
    (Finding(Status.FAIL, "clearance", "0.2 m", "≥ 0.3 m", -0.1, "m", 0.2, tick=480, place=(1.0, 2.0)),),
)
PASSED = Verdict("collisions", "collisions", "fail", (Finding(Status.PASS, "collisions", "0", "≤ 0"),))


def runs(count: int) -> list[RunFinished]:
    return [
        RunFinished(
            RunResult(
                RunKey("a", seed, f"variation-{seed}"),
                "a.scenario.yaml",
                Outcome.FAILED if seed % 2 else Outcome.PASSED,
                (FAILED, PASSED) if seed % 2 else (PASSED,),
                metrics={"time_to_goal": None if seed % 2 else 10.0 + seed, "collisions": 0.0},
                simulated=20.0,
            ),
            wall=0.5,
        )
        for seed in range(1, count + 1)
    ]


def test_each_run_is_a_row_with_its_metrics_and_values(tmp_path: Path) -> None:
    aborted = RunFinished(error_result(RunKey("b", 1), "b.scenario.yaml", RunFailure("timeout", "too slow")))
    finished_runs = [*reversed(runs(4)), aborted]
    values = {RunKey("a", seed, f"variation-{seed}"): {"x": f"{seed} cm", "robot": "amr"} for seed in range(1, 5)}
    files = parquet.write_parquet(tmp_path / "tables", finished_runs, values)
    assert [file.name for file in files] == ["runs.parquet", "verdicts.parquet"]
    table = pq.read_table(files[0])
    rows = table.to_pylist()
    assert [(row["scenario"], row["seed"], row["outcome"]) for row in rows] == [
        ("a", 1, "failed"), ("a", 2, "passed"), ("a", 3, "failed"), ("a", 4, "passed"), ("b", 1, "error"),
    ]  # fmt: skip
    assert [row["metric_time_to_goal"] for row in rows] == [None, 12.0, None, 14.0, None]
    assert [row["value_robot"] for row in rows] == ["amr"] * 4 + [None]
    assert all(math.isclose(row["value_x"], row["seed"] / 100) for row in rows[:4])
    assert (rows[4]["error_kind"], rows[4]["error_message"]) == ("timeout", "too slow")
    assert pc.mean(table["metric_collisions"]).as_py() == 0.0
    findings = pq.read_table(files[1]).to_pylist()
    assert [(row["run"], row["id"], row["status"]) for row in findings] == [
        (0, "near", "fail"), (0, "collisions", "pass"), (1, "collisions", "pass"),
        (2, "near", "fail"), (2, "collisions", "pass"), (3, "collisions", "pass"),
    ]  # fmt: skip
    assert (findings[0]["margin"], findings[0]["time"], findings[0]["x"], findings[0]["y"]) == (-0.1, 2.0, 1.0, 2.0)


def test_groups_of_rows_are_one_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole_files = parquet.write_parquet(tmp_path / "whole", runs(25), {})
    monkeypatch.setattr(parquet, "RUNS_PER_GROUP", 10)
    part_files = parquet.write_parquet(tmp_path / "parts", runs(25), {})
    for table_file, parts_file in zip(whole_files, part_files, strict=True):
        assert pq.read_table(table_file) == pq.read_table(parts_file)
    assert pq.ParquetFile(part_files[0]).num_row_groups == 3


def test_a_session_without_runs_has_empty_tables(tmp_path: Path) -> None:
    files = parquet.write_parquet(tmp_path, [], {})
    assert [pq.read_table(file).num_rows for file in files] == [0, 0]
