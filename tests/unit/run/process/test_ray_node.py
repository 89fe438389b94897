"""Tests of jobs that are packed on one machine and run on another machine of a Ray cluster."""

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from simscen.core.errors import UsageError
from simscen.core.version import PACKAGE
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.process.job_transfer import PackedJob, SentFile, Unpacker, digest_of, pack
from simscen.run.process.jobs import Job
from simscen.run.process.ray_node import FileChunk, JobQueue, NodeRunner
from simscen.run.simulate import simulate

SCENARIO = """
simscen: 1
world: ../maps/room.yaml
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 3, y: 1}}]
time_limit: 2 s
pass: [{collisions: {max: 0}}]
"""


def receive(content: bytes) -> bytes:
    return content


def send(path: Path) -> SentFile:
    data = path.read_bytes()
    return SentFile(digest_of(data), data)


@pytest.fixture
def job(tmp_path: Path) -> Job:
    """A job in the world of a ROS map. Only the file of the map names its image."""
    home = tmp_path / "here"
    (home / "maps").mkdir(parents=True)
    (home / "scenarios").mkdir()
    cells = np.full((60, 80), 254, np.uint8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 0
    Image.fromarray(cells).save(home / "maps/room.pgm")
    (home / "maps/room.yaml").write_text(
        "image: room.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    (home / "scenarios/a.scenario.yaml").write_text(SCENARIO)
    loaded = load_scenario(home / "scenarios/a.scenario.yaml", home)
    return Job(3, loaded, loaded.key(1), tmp_path / "out", 60.0)


def log_of(job: Job, folder: Path) -> bytes:
    folder.mkdir()
    simulate(prepare(job.scenario), 1, log=folder / "run.mcap")
    return (folder / "run.mcap").read_bytes()


def test_existing_files_with_the_same_content_are_not_copied(job: Job, tmp_path: Path) -> None:
    unpacker = Unpacker(tmp_path / "there", receive)
    unpacked = unpacker.unpack(pack(job, send), tmp_path / "run")
    assert unpacked.scenario == job.scenario
    assert unpacked.folder == tmp_path / "run"
    assert not (tmp_path / "there").exists()


@pytest.mark.parametrize("change", ["removed", "changed"])
def test_a_machine_without_the_files_gets_them_and_writes_the_same_log(job: Job, tmp_path: Path, change: str) -> None:
    packed, expected = pack(job, send), log_of(job, tmp_path / "log")
    home = tmp_path / "here"
    if change == "removed":
        shutil.rmtree(home)
    else:
        (home / "maps/room.pgm").write_bytes(b"another map")
    unpacked = Unpacker(tmp_path / "there", receive).unpack(packed, tmp_path / "run")
    moved = tmp_path / "there" / str(home).lstrip("/")
    assert unpacked.scenario.file == moved / "scenarios/a.scenario.yaml"
    assert unpacked.scenario.root == moved
    assert log_of(unpacked, tmp_path / "again") == expected


def test_files_of_simscen_are_read_from_the_package_on_each_machine(job: Job, tmp_path: Path) -> None:
    packed = pack(job, send)
    assert job.scenario.robot.path.is_relative_to(PACKAGE)
    assert not any(Path(path).is_relative_to(PACKAGE) for path in packed.files)
    unpacked = Unpacker(tmp_path / "there", receive).unpack(packed, tmp_path / "run")
    assert unpacked.scenario.robot.path == job.scenario.robot.path


def test_a_queue_gives_each_job_to_one_runner_and_records_the_runner() -> None:
    queue = JobQueue()
    jobs = [PackedJob(number, b"", {}) for number in range(3)]
    for job in jobs:
        queue.add(job)
    assert [queue.take("a"), queue.take("b"), queue.take("a"), queue.take("b")] == [*jobs, None]
    assert queue.taken_by("a") == [0, 2]
    assert queue.taken_by("b") == [1]
    queue.clear()
    assert queue.taken_by("a") == []


def test_a_node_whose_fork_server_cannot_start_leaves_the_jobs_to_other_nodes(job: Job) -> None:
    queue = JobQueue()
    for number in range(5):
        queue.add(pack(replace(job, number=number), send))
    remote_queue = SimpleNamespace(take=SimpleNamespace(remote=queue.take))
    runner = NodeRunner(2, ("-c", "import no_such_module"), receive)
    with pytest.raises(UsageError, match=r"(?s)cannot start: it exited 1.*No module named 'no_such_module'"):
        list(runner.run(remote_queue, "a", ()))
    runner.close()
    assert queue.taken_by("a") == [0, 1]
    assert queue.take("b").number == 2


def test_large_files_are_sent_in_pieces(job: Job, tmp_path: Path, monkeypatch) -> None:
    from simscen.run.process import ray_node

    monkeypatch.setattr(ray_node, "CHUNK_BYTES", 4)
    (tmp_path / "out/inner").mkdir(parents=True)
    (tmp_path / "out/inner/file").write_bytes(b"123456789")
    (tmp_path / "out/empty").write_bytes(b"")
    assert list(ray_node._file_chunks(3, tmp_path / "out")) == [
        FileChunk(3, "empty", b""),
        *(FileChunk(3, "inner/file", data) for data in (b"1234", b"5678", b"9")),
    ]


def test_a_runner_reports_the_version_and_the_code_of_its_simscen() -> None:
    from simscen.core.version import __version__
    from simscen.run.platform_fingerprint import source_digest

    assert NodeRunner(1, (), receive).software() == (__version__, source_digest())


def test_a_closed_runner_leaves_no_files() -> None:
    runner = NodeRunner(1, (), receive)
    (runner._folder / "inputs").mkdir()
    runner.close()
    assert not runner._folder.exists()
