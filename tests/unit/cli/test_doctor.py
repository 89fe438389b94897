"""Tests of the checks of `simscen doctor`."""

import errno
import os
import re
import resource
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

from simscen.bench.speed import run_speed
from simscen.cli import installation
from simscen.cli.commands import doctor
from simscen.run.disk_cache import DiskCache, cache_folder


@pytest.fixture
def without_slow_checks(monkeypatch):
    """Replace the checks that simulate a run."""
    monkeypatch.setattr(doctor, "check_run", lambda: "not now")
    monkeypatch.setattr(doctor, "check_speed", lambda: "not now, either")


def test_working_installation_passes_within_80_columns(simscen, monkeypatch) -> None:
    monkeypatch.setattr(doctor, "check_speed", lambda: "not now")
    monkeypatch.setenv("COLUMNS", "80")
    result = simscen("doctor")
    assert result.code == 0
    lines = result.out.splitlines()
    assert all(line.startswith(("  ✓ ", " " * 15)) for line in lines)
    assert all(len(line) <= 80 or line.endswith(str(Path.cwd())) for line in lines), (
        "a line is longer only if it ends with a path"
    )
    assert "1 s simulated twice, equal logs: sha256 " in result.out.splitlines()[-2]


def test_failed_check_is_reported_and_the_others_still_run(simscen, without_slow_checks, monkeypatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(1, 1, 30 << 20))
    result = simscen("doctor")
    assert result.code == 3
    assert next(line for line in result.out.splitlines() if "✗" in line).startswith(
        "  ✗ disk       only 30 MiB are free"
    )
    assert result.out.splitlines()[-1] == "  ✓ speed      not now, either"


def test_missing_temporary_folder_is_a_failed_check(simscen, without_slow_checks, monkeypatch) -> None:
    def missing() -> str:
        raise FileNotFoundError(errno.ENOENT, "No usable temporary directory found")

    monkeypatch.setattr(tempfile, "gettempdir", missing)
    result = simscen("doctor")
    assert result.code == 3
    assert "  ✗ tmp        No usable temporary directory found; set TMPDIR" in result.out
    assert "  ✓ disk " in result.out


def test_engine_that_cannot_be_imported_is_a_failed_check(simscen, without_slow_checks, monkeypatch) -> None:
    def missing_library() -> str:
        raise ImportError("libGL.so.1: cannot open shared object file")

    monkeypatch.setattr(doctor, "check_run", missing_library)
    result = simscen("doctor")
    assert result.code == 3
    assert "  ✗ run        ImportError: libGL.so.1: cannot open shared object file\n" in result.out
    assert result.out.splitlines()[-1] == "  ✓ speed      not now, either"


def test_cache_is_shown_and_a_foreign_cache_fails(tmp_path: Path, monkeypatch) -> None:
    assert doctor.check_cache() == "disabled by SIMSCEN_CACHE_DIR"
    monkeypatch.setenv("SIMSCEN_CACHE_DIR", str(tmp_path))
    folder = cache_folder(os.environ)
    assert doctor.check_cache() == f"{folder}: empty"
    DiskCache(folder).put("a" * 64, bytes(99_968))
    assert doctor.check_cache() == f"{folder}: 1 files, 0.1 MB of at most 256; safe to delete"
    folder.chmod(0o777)
    with pytest.raises(installation.CheckFailed, match="other users may write to it"):
        doctor.check_cache()


def test_speed_check_compares_a_patrol_with_pybullet(monkeypatch) -> None:
    def patrol(cpu: float, pybullet: float) -> run_speed.PatrolTimes:
        return run_speed.PatrolTimes(60.0, cpu, {"physics": 1.0}, pybullet, (cpu,), (pybullet,), {"physics": (1.0,)})

    monkeypatch.setattr(run_speed, "measure_patrol", lambda _: patrol(2.0, 0.5))
    assert doctor.check_speed() == "30 times real time on one core, 4.0 times the cost of PyBullet alone"
    monkeypatch.setattr(run_speed, "measure_patrol", lambda _: patrol(90.0, 20.0))
    with pytest.raises(installation.CheckFailed, match="a faster processor"):
        doctor.check_speed()


@pytest.mark.parametrize(
    ("limit", "value", "expected_text"),
    [
        (resource.RLIMIT_AS, 200 << 20, "a run gets only 200 MiB of memory; raise `ulimit -v`"),
        (resource.RLIMIT_NOFILE, 20, "may open only 20 files; raise `ulimit -n`"),
        (resource.RLIMIT_FSIZE, 1 << 20, "a file may have only 1 MiB; raise `ulimit -f`"),
    ],
)
def test_tight_limits_fail_with_a_hint(monkeypatch, limit, value, expected_text) -> None:
    original = resource.getrlimit
    monkeypatch.setattr(resource, "getrlimit", lambda kind: (value, value) if kind == limit else original(kind))
    with pytest.raises(installation.CheckFailed, match=re.escape(expected_text)):
        installation.check_resource_limits()


def test_memory_limit_of_a_container_counts(monkeypatch) -> None:
    monkeypatch.setattr(installation, "_cgroup_memory", lambda: 300 << 20)
    with pytest.raises(installation.CheckFailed, match="a run gets only 300 MiB of memory"):
        installation.check_resource_limits()


def test_unsupported_packages_fail(monkeypatch) -> None:
    monkeypatch.setattr(installation, "unmet_requirements", lambda: ["numpy 1.0 is installed"])
    with pytest.raises(installation.CheckFailed, match=r"numpy 1\.0 is installed"):
        installation.check_packages()


def test_unsupported_python_and_missing_packages_fail(monkeypatch) -> None:
    with pytest.raises(installation.CheckFailed, match="pip install no-such-package"):
        installation._version("no-such-package")
    monkeypatch.setattr(sys, "version_info", (3, 14, 0))
    with pytest.raises(installation.CheckFailed, match=r"needs Python 3\.10 to 3\.13"):
        installation.check_python()


def test_sandbox_without_pidfd_fails(monkeypatch) -> None:
    def refused(_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "pidfd_open", refused)
    with pytest.raises(installation.CheckFailed, match="Operation not permitted"):
        installation.check_pidfd()


def test_unwritable_folder_fails(tmp_path) -> None:
    with pytest.raises(installation.CheckFailed, match="cannot write in"):
        installation.check_writable(tmp_path / "nowhere")


def test_configured_stacks_are_listed_and_missing_programs_fail(monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    file = tmp_path / "simscen/config.yaml"
    assert doctor.check_stacks() == f"{file} does not exist; define external stacks with --stack"
    file.parent.mkdir()
    file.write_text("stacks: {mine: {command: sh -c 'exit 0'}, other: {command: sh}}\n")
    assert doctor.check_stacks() == f"{file}: mine = sh -c 'exit 0', other = sh"
    file.write_text("stacks:\n  mine: {command: ./gone}\n")
    with pytest.raises(installation.CheckFailed, match=r"config\.yaml:2:19: no such file or directory: `\./gone`"):
        doctor.check_stacks()
    file.write_text("stacks: [mine]\n")
    with pytest.raises(installation.CheckFailed, match=r"config\.yaml:1:9: expected a mapping, got a list"):
        doctor.check_stacks()
