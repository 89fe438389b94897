"""Tests of `simscen merge` and `--shard`: the merged results equal the results of a single session."""

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from simscen.cli.main import app
from simscen.cli.session.selection import PARALLEL_JOBS, parse_shard, scenarios_of_shard
from simscen.core.errors import InvalidInput, NothingSelected, UsageError

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 0.1 s
pass: [{collisions: {max: 0}}, {clearance: {min: LIMIT}}]
"""


@pytest.fixture(scope="module")
def sessions(simscen_in, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a session `whole` of three scenarios, of which one fails, and its shards `s1` and `s2`."""
    folder = tmp_path_factory.mktemp("sessions")
    for name in "abc":
        text = SCENARIO.replace("LIMIT", "3 m" if name == "c" else "0.1 m")
        (folder / f"{name}.scenario.yaml").write_text(text)
    assert simscen_in(folder, "run", ".", "--repeat", 2, "--out", "whole").code == 1
    shards = [simscen_in(folder, "run", ".", "--repeat", 2, "--out", f"s{k}", "--shard", f"{k}/2") for k in (1, 2)]
    assert [shard.code for shard in shards] == [1, 0]
    return folder


def test_merged_results_equal_the_results_of_a_single_session(
    simscen, sessions: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(sessions)
    assert simscen("merge", "s2", "s1", "--out", "all", "--junit", "all/ci/merged.xml").code == 1
    assert Path("all/ci/merged.xml").read_bytes() == Path("all/junit.xml").read_bytes()
    assert Path("all/results.json").read_bytes() == Path("whole/results.json").read_bytes()
    times = re.compile(rb' time="[0-9.]+"')
    merged, whole = (times.sub(b"", Path(name, "junit.xml").read_bytes()) for name in ("all", "whole"))
    assert merged.replace(b"all/runs", b"whole/runs") == whole
    for run in json.loads(Path("all/results.json").read_text())["runs"]:
        assert Path("all", run["artifacts"]["mcap"]).is_file()
    assert Path("all/report.html").is_file()
    assert Path("all/run.json").is_file()


@pytest.mark.slow
def test_merged_folder_can_be_reported_again(simscen, sessions: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(sessions)
    simscen("merge", "s1", "s2", "--out", "again")
    original = Path("again/results.json").read_bytes()
    assert simscen("report", "again").code == 1
    assert Path("again/results.json").read_bytes() == original


def test_unfinished_runs_of_a_shard_are_errors(
    simscen, sessions: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(sessions)
    killed = tmp_path / "killed"
    killed.mkdir()
    lines = Path("s1/events.jsonl").read_bytes().splitlines(keepends=True)
    (killed / "events.jsonl").write_bytes(b"".join(lines[:3]))  # the plan and the start of a run
    assert simscen("merge", killed, "s2", "--out", tmp_path / "all").code == 3
    kinds = [
        run["error"]["kind"] for run in json.loads((tmp_path / "all/results.json").read_text())["runs"] if run["error"]
    ]
    assert set(kinds) <= {"interrupted", "not-run"}
    assert kinds


def test_runs_that_are_in_two_shards_are_refused(sessions: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(sessions)
    result = CliRunner().invoke(app, ["merge", "whole", "s1", "--out", "twice"])
    assert isinstance(result.exception, InvalidInput)
    assert {problem.code for problem in result.exception.problems} == {"SC812"}
    assert not Path("twice").exists()


def test_missing_shard_is_an_error_unless_it_is_allowed(
    simscen, sessions: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The merged session would otherwise pass without the scenario that fails."""
    monkeypatch.chdir(sessions)
    result = CliRunner().invoke(app, ["merge", "s2", "--out", "partial"])
    assert isinstance(result.exception, InvalidInput)
    assert [problem.message for problem in result.exception.problems] == ["shard 1/2 is missing"]
    assert not Path("partial").exists()
    assert simscen("merge", "s2", "--out", "partial", "--allow-missing").code == 0


def test_unwritable_junit_is_an_error_before_anything_is_merged(
    simscen, sessions: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(sessions)
    result = simscen("merge", "s1", "s2", "--out", "unmerged", "--junit", "a.scenario.yaml/junit.xml")
    assert result.code == 2
    assert not Path("unmerged").exists()


def test_output_folder_must_be_empty(sessions: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(sessions)
    result = CliRunner().invoke(app, ["merge", "s1", "s2", "--out", "whole"])
    assert isinstance(result.exception, UsageError)


class TitledScenario:
    """Scenario of which only the title is known."""

    def __init__(self, title: str) -> None:
        self.title = title


def test_measured_times_balance_the_shards() -> None:
    """One scenario takes as long as all others; each scenario is in exactly one shard, in its order."""
    scenarios = [TitledScenario(name) for name in "abcdef"]
    times = {"a": 1.0, "b": 1.0, "c": 5.0, "d": 1.0, "e": 1.0}  # f counts as the median
    first, second = ([scenario.title for scenario in scenarios_of_shard(scenarios, k, 2, times)] for k in (1, 2))  # type: ignore[arg-type]
    assert (first, second) == (["c"], ["a", "b", "d", "e", "f"])


def test_without_times_each_shard_has_every_nth_scenario() -> None:
    scenarios = [TitledScenario(name) for name in "abcde"]
    assert [scenario.title for scenario in scenarios_of_shard(scenarios, 2, 2, {})] == ["b", "d"]  # type: ignore[arg-type]
    with pytest.raises(NothingSelected):
        scenarios_of_shard(scenarios, 6, 6, {})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("environ", "expected"),
    [
        ({"CI_NODE_INDEX": "2", "CI_NODE_TOTAL": "4"}, (2, 4)),
        ({"CIRCLE_NODE_INDEX": "0", "CIRCLE_NODE_TOTAL": "3"}, (1, 3)),
        ({"BUILDKITE_PARALLEL_JOB": "2", "BUILDKITE_PARALLEL_JOB_COUNT": "3"}, (3, 3)),
        ({"SLURM_ARRAY_TASK_ID": "12", "SLURM_ARRAY_TASK_COUNT": "5", "SLURM_ARRAY_TASK_MIN": "10"}, (3, 5)),
        ({"JOB_COMPLETION_INDEX": "4", "JOB_COMPLETIONS": "5"}, (5, 5)),
    ],
)
def test_shard_auto_reads_the_number_of_the_parallel_job(environ: dict[str, str], expected: tuple[int, int]) -> None:
    assert parse_shard("auto", environ) == expected


@pytest.mark.parametrize("environ", [{}, {"CI_NODE_INDEX": "2"}, {"CI_NODE_INDEX": "x", "CI_NODE_TOTAL": "3"}])
def test_shard_auto_outside_of_a_parallel_job_is_an_error(environ: dict[str, str]) -> None:
    with pytest.raises(UsageError, match=PARALLEL_JOBS[0].index_variable):
        parse_shard("auto", environ)
