"""Sessions on a Ray cluster of three nodes on this machine."""

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
    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    made.others = [made.add_node(num_cpus=1) for _ in range(2)]
    yield made
    made.shutdown()


@pytest.fixture
def jobs(tmp_path: Path) -> Callable[..., list[Job]]:
    def make(*faults: str) -> list[Job]:
        made = []
        for number, fault in enumerate(faults):
            file = tmp_path / f"{number}.scenario.yaml"
            file.write_text(SCENARIO.format(fault=fault))
            loaded = load_scenario(file, tmp_path)
            made.append(Job(number, loaded, loaded.key(1), tmp_path / f"out-{number}", 60.0))
        return made

    return make


def processes(word: str) -> list[int]:
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            command = command_of(int(process.name))
        except OSError:
            continue
        if word.encode() in command:
            found.append(int(process.name))
    return found


def parent_of(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])


def command_of(pid: int) -> bytes:
    return Path(f"/proc/{pid}/cmdline").read_bytes()


def test_every_job_is_run_once_and_its_files_arrive(cluster, jobs) -> None:
    made = jobs(*["fine"] * 12, "segfault", "exit-0")
    with RayBackend(cluster.address, 3, ENTRY) as backend:
        for _ in range(2):  # the second time, the runners exist already
            updates = list(backend.run(made))
            assert sorted(one.number for one in updates if isinstance(one, Started)) == list(range(14))
            ends = {one.number: one.end for one in updates if isinstance(one, Ended)}
            assert [isinstance(ends[n], ProcessEnd) and ends[n].code for n in range(12)] == [0] * 12
            assert ends[12].signal == signal.SIGSEGV
            assert all((job.folder / "result.json").is_file() for job in made[:12])
    assert not processes(ENTRY[0])


def test_jobs_of_a_killed_node_are_run_again_on_another_one(cluster, jobs) -> None:
    made = jobs(*["fine"] * 30)
    with RayBackend(cluster.address, 3, ENTRY) as backend:
        updates = []
        for update in backend.run(made):
            updates.append(update)
            if len(updates) == 10:
                here = ray.get_runtime_context().get_node_id()  # any node of this machine
                victim = next(node for node in cluster.others if node.node_id != here)
                cluster.remove_node(victim, allow_graceful=False)
    ends = [one for one in updates if isinstance(one, Ended)]
    assert sorted(one.number for one in ends) == list(range(30))
    assert all(isinstance(one.end, ProcessEnd) and one.end.code == 0 for one in ends)


def test_a_job_that_is_lost_twice_is_an_error(cluster, jobs) -> None:
    """Kill each runner as soon as it has the job, which never ends."""
    (job,) = jobs("hang")
    done = threading.Event()

    def kill_runners() -> None:
        while not done.wait(0.1):
            for server in processes(ENTRY[0]):
                runner = parent_of(server)
                if b"ray::" in command_of(runner):
                    time.sleep(1.0)
                    os.kill(runner, signal.SIGKILL)

    killer = threading.Thread(target=kill_runners)
    killer.start()
    try:
        with RayBackend(cluster.address, 1, ENTRY) as backend:
            (end,) = (one.end for one in backend.run([job]) if isinstance(one, Ended))
    finally:
        done.set()
        killer.join()
    assert isinstance(end, ForkServerDeath)
    assert "was lost with its node" in end.description


def test_a_session_on_a_cluster_writes_the_same_results(cluster, tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(DRIVE)
    for out, options in (("here", ["-j", "2"]), ("there", ["--backend", "ray", "--address", cluster.address])):
        command = [sys.executable, "-m", "simscen", "run", "a.scenario.yaml", "--repeat", "6", "--out", out, *options]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert "3 workers" in done.stdout or out == "here"
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
    end = time.monotonic() + 20
    while set(servers) & set(processes("fork_server_main")) and time.monotonic() < end:
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
