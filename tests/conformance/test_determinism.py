"""Conformance tests of determinism: a run depends only on scenario and seed."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from simscen.run.process import fork_server_process

SIMSCEN = Path(sys.executable).with_name("simscen")
SCRIPTED_FORK_SERVER = str(Path(__file__).with_name("scripted_fork_server.py"))
BUSY = "import os, time; os.nice(10); end = time.monotonic() + 60\nwhile time.monotonic() < end: sum(range(100000))"
NOISY = """\
events: [{when: {time: 1 s}, do: {spawn: {name: box, box: [0.2, 0.2, 0.4], pose: {x: 1.9, y: 1.6}}}}]
faults:
  - {sensor: lidar, noise: {std: 5 cm}}
  - {sensor: odom, slip: {left: 0.1, right: 0.05}, when: {time: 1 s}, for: 1 s}
stack: {localizer: {type: scan_matching_amcl, max_particles: 500}}
"""


def results(out: Path) -> dict[str, tuple[bytes, str]]:
    """Return the result and the hash of the log of each run, by its folder."""
    return {
        log.parent.relative_to(out).as_posix(): (
            (log.parent / "result.json").read_bytes(),
            hashlib.sha256(log.read_bytes()).hexdigest(),
        )
        for log in sorted(out.rglob("run.mcap"))
    }


@pytest.fixture
def pair(folder: Path) -> Path:
    """Write a scenario without and one with random noise, slip, and localization; return the folder."""
    text = (folder / "a.scenario.yaml").read_text()
    (folder / "b.scenario.yaml").write_text(text + NOISY)
    return folder


@pytest.fixture(scope="module")
def reference_out(tmp_path_factory: pytest.TempPathFactory, texts: dict[str, str]) -> Path:
    """Run the scenarios of `pair` one after the other in another folder, once for all tests; return the output."""
    home = tmp_path_factory.mktemp("reference") / "home"
    home.mkdir()
    for name, text in {**texts, "b.scenario.yaml": texts["a.scenario.yaml"] + NOISY}.items():
        (home / name).write_text(text)
    command = [SIMSCEN, "run", ".", "-j", "1", "--out", "out"]
    done = subprocess.run(command, cwd=home, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return home / "out"


@pytest.fixture
def reference(reference_out: Path) -> dict[str, tuple[bytes, str]]:
    """Return the result and the hash of the log of both runs in `reference_out`."""
    found = results(reference_out)
    assert len(found) == 2
    return found


def test_86_87_log_does_not_depend_on_order_folder_hash_seed_or_load(reference, reference_out, pair: Path) -> None:
    other_folder = pair.parent / "other_folder"
    other_folder.mkdir()
    busy = subprocess.Popen([sys.executable, "-c", BUSY])
    try:
        done = subprocess.run(
            [SIMSCEN, "run", "../home/b.scenario.yaml", "../home/a.scenario.yaml", "-j", "2", "--out", "out"],
            cwd=other_folder, capture_output=True, text=True, timeout=120, check=False,
            env={**os.environ, "PYTHONHASHSEED": "4711", "OMP_NUM_THREADS": "4", "LC_ALL": "C", "TZ": "Asia/Tokyo"},
        )  # fmt: skip
    finally:
        busy.kill()
        busy.wait()
    assert done.returncode == 0, done.stdout + done.stderr
    assert results(other_folder / "out") == reference
    assert (other_folder / "out/results.json").read_bytes() == (reference_out / "results.json").read_bytes()


def test_88_run_after_a_crash_has_the_same_log(reference, pair: Path, simscen, monkeypatch) -> None:
    monkeypatch.setattr("simscen.cli.session.fork_server_start.FORK_SERVER", (SCRIPTED_FORK_SERVER,))
    text = (pair / "a.scenario.yaml").read_text()
    (pair / "a.scenario.yaml").write_text(text.replace("seed: 7", "tags: [crash]"))
    assert simscen("run", ".", "-j", 1, "--out", "out").code == 3
    document = json.loads((pair / "out/results.json").read_text())
    assert (document["error"], document["passed"]) == (1, 1)
    assert results(pair / "out")["runs/b/seed-7"] == reference["runs/b/seed-7"]


@pytest.mark.slow
def test_world_that_never_finishes_preparing_times_out_its_run_only(pair: Path, simscen, monkeypatch) -> None:
    monkeypatch.setattr("simscen.cli.session.fork_server_start.FORK_SERVER", (SCRIPTED_FORK_SERVER,))
    text = (pair / "a.scenario.yaml").read_text()
    (pair / "a.scenario.yaml").write_text(text.replace("seed: 7", "tags: [slow-to-prepare]"))
    assert simscen("run", ".", "-j", 1, "--out", "out", "--wall-limit", 3).code == 3
    document = json.loads((pair / "out/results.json").read_text())
    assert [(run["outcome"], (run["error"] or {}).get("kind")) for run in document["runs"]] == [
        ("error", "timeout"),
        ("passed", None),
    ]


def test_89_another_seed_gives_another_run_and_seed_0_is_an_error(reference, pair: Path, simscen) -> None:
    assert simscen("run", "b.scenario.yaml", "--seed", 8, "--out", "out").code == 0
    assert results(pair / "out")["runs/b/seed-8"][1] != reference["runs/b/seed-7"][1]
    ended = simscen("run", "b.scenario.yaml", "--seed", 0, "--out", "none")
    assert ended.code == 2
    assert not (pair / "none").exists()


@pytest.mark.slow
def test_90_verdicts_are_equal_without_fused_multiply_add(reference, pair: Path, simscen, monkeypatch) -> None:
    without_fma = {
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F",
        "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX",
    }
    environment = fork_server_process.clean_environment()
    monkeypatch.setattr(fork_server_process, "clean_environment", lambda: {**environment, **without_fma})
    assert simscen("run", ".", "--out", "out").code == 0
    assert simscen("run", ".", "--out", "again", "--check-against", "out").code == 0
    assert {"blas", "libm", "numpy", "numpy_dispatch"} == set(
        json.loads((pair / "out/run.json").read_text())["arithmetic"]
    )
    verdicts = {
        name: [verdict["status"] for verdict in json.loads(result)["verdicts"]]
        for name, (result, _) in results(pair / "out").items()
    }
    assert verdicts == {name: ["pass"] for name in reference}


@pytest.mark.slow
def test_run_that_differs_from_another_session_is_an_error(pair: Path, simscen) -> None:
    assert simscen("run", "a.scenario.yaml", "--out", "out").code == 0
    assert simscen("run", "a.scenario.yaml", "--out", "same", "--check-against", "out").code == 0
    command = ("run", "a.scenario.yaml", "--check-determinism", "out", "--out", "alike")
    assert simscen(*command).code == 0, "an output folder is what to compare with, not where to look for scenarios"
    file = pair / "a.scenario.yaml"
    file.write_text(file.read_text().replace("pose: {x: 1,", "pose: {x: 1.01,"))
    changed = simscen("run", "a.scenario.yaml", "--out", "changed", "--check-against", "out")
    assert changed.code == 3
    assert "nondeterministic: not as in out: tick 0 (t = 0.000 s): the true pose differs by 0.01 m" in changed.out
    missing = simscen("run", "a.scenario.yaml", "--seed", "99", "--out", "missing", "--check-against", "out")
    assert missing.code == 3
    assert "seed-99/run.mcap: No such file or directory" in missing.out
    no_folder = simscen("run", "a.scenario.yaml", "--out", "never", "--check-against", "no_folder")
    assert (no_folder.code, no_folder.err) == (2, "simscen: --check-against no_folder: no such folder\n")
