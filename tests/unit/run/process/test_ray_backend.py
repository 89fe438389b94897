"""Tests of sessions on a Ray cluster of three nodes on this machine."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from simscen.core.errors import UsageError
from simscen.loading.scenario import load_scenario
from simscen.run.process.jobs import Ended, ForkServerDeath, Job, ProcessEnd, Started

pytest.importorskip("ray")
pytestmark = pytest.mark.slow

import ray  # noqa: E402
from ray.cluster_utils import Cluster  # noqa: E402

from simscen.run.process.ray_backend import RayBackend, connect  # noqa: E402

ENTRY = (str(Path(__file__).parents[1] / "process/faulty_fork_server.py"),)
SCENARIO = """
simscen: 1
tags: [{fault}]
world: {{simscen: 1, walls: [{{points: [[0, 0], [9, 0]]}}]}}
robot: {{pose: {{x: 1, y: 1}}}}
pass: [{{collisions: {{max: 0}}}}]
"""
DRIVE = """
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [9, 0], [9, 9], [0, 9], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 2, y: 1}}]
pass: [{goals_reached: {}}]
"""


@pytest.fixture
def cluster() -> Iterator[Any]:
    """A cluster of a head node and two further nodes, which are in `others`."""
    ray_cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    ray_cluster.others = [ray_cluster.add_node(num_cpus=1) for _ in range(2)]
    yield ray_cluster
    ray_cluster.shutdown()


@pytest.fixture
def jobs(tmp_path: Path) -> Callable[..., list[Job]]:
    """Return a function that makes one job for each fault of `faulty_fork_server`."""

    def make(*faults: str) -> list[Job]:
        new_jobs = []
        for number, fault in enumerate(faults):
            file = tmp_path / f"{number}.scenario.yaml"
            file.write_text(SCENARIO.format(fault=fault))
            loaded = load_scenario(file, tmp_path)
            new_jobs.append(Job(number, loaded, loaded.key(1), tmp_path / f"out-{number}", 60.0))
        return new_jobs

    return make


def processes(word: str) -> list[int]:
    """Return the ids of the processes whose command line contains the word."""
    pids = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            command = command_of(int(process.name))
        except OSError:
            continue
        if word.encode() in command:
            pids.append(int(process.name))
    return pids


def parent_of(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])


def command_of(pid: int) -> bytes:
    return Path(f"/proc/{pid}/cmdline").read_bytes()


def test_every_job_is_run_once_and_its_files_arrive(cluster, jobs) -> None:
    planned = jobs(*["fine"] * 12, "segfault", "exit-0")
    with RayBackend(cluster.address, 3, ENTRY) as backend:
        for _ in range(2):  # the second time, the runners exist already
            updates = list(backend.run(planned))
            assert sorted(update.number for update in updates if isinstance(update, Started)) == list(range(14))
            ends = {update.number: update.end for update in updates if isinstance(update, Ended)}
            assert [isinstance(ends[n], ProcessEnd) and ends[n].code for n in range(12)] == [0] * 12
            assert ends[12].signal == signal.SIGSEGV
            assert all((job.folder / "result.json").is_file() for job in planned[:12])
    assert not processes(ENTRY[0])


def test_jobs_of_a_killed_node_are_run_again_on_another_one(cluster, jobs) -> None:
    planned = jobs(*["fine"] * 30)
    with RayBackend(cluster.address, 3, ENTRY) as backend:
        updates = []
        for update in backend.run(planned):
            updates.append(update)
            if len(updates) == 10:
                driver_node = ray.get_runtime_context().get_node_id()
                removed_node = next(node for node in cluster.others if node.node_id != driver_node)
                cluster.remove_node(removed_node, allow_graceful=False)
    ended = [update for update in updates if isinstance(update, Ended)]
    assert sorted(update.number for update in ended) == list(range(30))
    assert all(isinstance(update.end, ProcessEnd) and update.end.code == 0 for update in ended)


def test_a_job_that_is_lost_twice_is_an_error(cluster, jobs) -> None:
    """Each runner is killed after it has taken the job, which never ends."""
    (job,) = jobs("hang")
    is_lost = threading.Event()

    def kill_runners() -> None:
        while not is_lost.wait(0.1):
            for server in processes(ENTRY[0]):
                runner = parent_of(server)
                if b"ray::" in command_of(runner):
                    time.sleep(1.0)
                    os.kill(runner, signal.SIGKILL)

    killer = threading.Thread(target=kill_runners)
    killer.start()
    try:
        with RayBackend(cluster.address, 1, ENTRY) as backend:
            (end,) = (update.end for update in backend.run([job]) if isinstance(update, Ended))
    finally:
        is_lost.set()
        killer.join()
    assert isinstance(end, ForkServerDeath)
    assert "was lost with its node" in end.description


def test_a_session_on_a_cluster_writes_the_same_results(cluster, tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(DRIVE)
    for out, options in (("here", ["-j", "2"]), ("there", ["--backend", "ray", "--address", cluster.address])):
        command = [sys.executable, "-m", "simscen", "run", "a.scenario.yaml", "--repeat", "6", "--out", out, *options]
        completed = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert completed.returncode == 0, completed.stderr
        assert "3 workers" in completed.stdout or out == "here"
    for name in ("results.json", "runs/a/seed-4/run.mcap", "runs/a/seed-6/result.json"):
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()


def test_an_interrupt_ends_the_processes_on_all_nodes(cluster, tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(DRIVE)
    command = [sys.executable, "-m", "simscen", "run", ".", "--repeat", "500", "--out", "out", "--backend", "ray"]
    session = subprocess.Popen([*command, "--address", cluster.address], cwd=tmp_path, stdout=subprocess.PIPE)
    assert session.stdout is not None
    while b"\xe2\x9c\x93" not in session.stdout.readline():  # until a run has passed
        assert session.poll() is None
    servers = [
        pid for pid in processes("simscen.cli.session.fork_server_main") if b"ray::" in command_of(parent_of(pid))
    ]
    assert servers
    session.send_signal(signal.SIGINT)
    session.communicate(timeout=60)
    assert session.returncode == 130
    deadline = time.monotonic() + 20
    while set(servers) & set(processes("fork_server_main")) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not set(servers) & set(processes("fork_server_main"))


def test_a_node_whose_fork_server_cannot_start_is_named(cluster, jobs) -> None:
    with (
        RayBackend(cluster.address, 3, ("-c", "import no_such_module")) as backend,
        pytest.raises(UsageError, match=r"(?s)node [\d.]+: the fork server cannot start: it exited 1.*no_such_module"),
    ):
        list(backend.run(jobs("fine", "fine")))


def test_missing_cluster_is_an_error() -> None:
    with pytest.raises(UsageError, match=r"cannot connect to a Ray cluster at 127\.0\.0\.1:1: .*refused"):
        connect("127.0.0.1:1")
