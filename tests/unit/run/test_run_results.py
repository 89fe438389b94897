"""Tests of the results of runs whose worker process was killed or crashed."""

from dataclasses import replace
from pathlib import Path

import pytest

from simscen.loading.scenario import load_scenario
from simscen.run.process.jobs import Job, ProcessEnd
from simscen.run.sessions.results import finished_run

SCENARIO = """\
simscen: 1
world: {simscen: 1}
robot: {pose: {x: 1, y: 1}}
time_limit: 1
pass: [collisions: {max: 0}]
"""


KILLED = ProcessEnd(
    code=None,
    signal=9,
    killed_for="timeout",
    final_message=None,
    wall=60.0,
    cpu=1.0,
    peak_bytes=1,
    left_processes=False,
    output="",
)


@pytest.fixture
def job(tmp_path: Path) -> Job:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(SCENARIO)
    loaded = load_scenario(file, tmp_path)
    folder = tmp_path / "run"
    folder.mkdir()
    return Job(0, loaded, loaded.key(1), folder, 60.0)


def test_incomplete_description_of_a_stack_is_ignored(job: Job) -> None:
    """The worker was killed, or its disk was full, while it wrote the file."""
    (job.folder / "stack.a.json").write_text('{"about": {"warnings": ["no odome')
    (job.folder / "stack.b.json").write_text('{"about": {"warnings": ["no lidar"]}}')
    run = finished_run(job, KILLED)
    assert run.result.error.kind == "timeout"
    assert run.warnings == ("no lidar",)


def test_crash_by_a_real_time_signal_is_reported_by_number(job: Job) -> None:
    run = finished_run(job, replace(KILLED, killed_for=None, signal=40))
    assert run.result.error.message == "crashed: signal 40 (peak memory 0 MiB of 4096 MiB)"
