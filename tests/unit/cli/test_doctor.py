"""simscen doctor finds what would keep runs from working."""

import os
import shutil
import sys

import pytest

from simscen.cli import doctor


def test_a_sound_installation_is_well(simscen) -> None:
    ended = simscen("doctor")
    assert ended.code == 0
    assert all(line.startswith("  ✓ ") for line in ended.out.splitlines())
    assert "1 s simulated twice, equal logs: sha256 " in ended.out.splitlines()[-1]


def test_one_ill_thing_is_told_and_the_rest_is_checked(simscen, monkeypatch) -> None:
    monkeypatch.setattr(doctor, "run_twice", lambda: "not now")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(1, 1, 3 << 20))
    ended = simscen("doctor")
    assert ended.code == 3
    assert next(line for line in ended.out.splitlines() if "✗" in line).startswith("  ✗ here       only 3 MiB are free")
    assert ended.out.splitlines()[-1] == "  ✓ run        not now"


def test_other_pythons_and_missing_packages_are_ill(monkeypatch) -> None:
    with pytest.raises(doctor.Ill, match="pip install no-such-package"):
        doctor.package("no-such-package")
    monkeypatch.setattr(sys, "version_info", (3, 12, 1))
    with pytest.raises(doctor.Ill, match=r"needs 3\.10 or 3\.11"):
        doctor.python()


def test_a_sandbox_without_pidfd_is_ill(monkeypatch) -> None:
    def refused(_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "pidfd_open", refused)
    with pytest.raises(doctor.Ill, match="Operation not permitted"):
        doctor.pidfd()


def test_a_folder_that_takes_no_files_is_ill(tmp_path) -> None:
    with pytest.raises(doctor.Ill, match="cannot write in"):
        doctor.writable(tmp_path / "nowhere")
