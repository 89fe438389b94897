"""Tests of errors that `simscen run` reports before any run."""

import errno
import os
from pathlib import Path

import pytest


@pytest.mark.parametrize(
    ("options", "expected_text"),
    [
        (("--out", "good.scenario.yaml/out"), "cannot use the output folder"),
        (("--junit", "good.scenario.yaml/junit.xml"), "cannot write good.scenario.yaml/junit.xml"),
        (("--out", "a", "--resume", "b"), "--out and --resume exclude each other"),
        (("--resume", "nowhere"), "nowhere: error[SC810] no such folder"),
        (("--shard", "3/2"), "cannot read --shard 3/2"),
        (("--shard", "half"), "cannot read --shard half"),
        (("--seed", "4294967295", "--repeat", "2"), "above the largest seed, 4294967295"),
    ],
)
def test_invalid_options_are_reported_before_any_run(simscen, tmp_path: Path, options, expected_text) -> None:
    result = simscen("run", "good.scenario.yaml", *options)
    assert result.code == 2
    assert expected_text in result.err
    assert not list(tmp_path.rglob("*.mcap"))
    assert not (tmp_path / "simscen-out").exists()


def test_full_disk_is_reported_before_any_run(simscen, tmp_path: Path, monkeypatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for sync in ("fsync", "fdatasync"):
        with monkeypatch.context() as patch:
            patch.setattr(os, sync, full)
            result = simscen("run", "good.scenario.yaml", "--out", sync)
        assert result.code == 2
        assert result.err.endswith(f"{sync}: No space left on device\n")
        assert not list((tmp_path / sync).rglob("*.mcap"))


def test_empty_shard_selects_nothing(simscen) -> None:
    result = simscen("run", "good.scenario.yaml", "--shard", "2/2")
    assert (result.code, result.err) == (5, "simscen: shard 2/2 of 1 scenarios is empty\n")


SDF = """<sdf version='1.6'><world name='w'><model name='m'><static>1</static><link name='l'>
<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision></link></model>
<include><uri>model://nowhere</uri></include></world></sdf>"""


def test_unsupported_sdf_is_an_error_or_with_lenient_a_warning(simscen, tmp_path: Path) -> None:
    (tmp_path / "shop.sdf").write_text(SDF)
    (tmp_path / "shop.scenario.yaml").write_text(
        "simscen: 1\nworld: shop.sdf\nmap: none\nrobot: {pose: {x: 3, y: 3}}\npass: [{collisions: {max: 0}}]\n"
    )
    strict = simscen("validate", "shop.scenario.yaml")
    assert strict.code == 2
    assert "shop.sdf:3:10: error[SC310] world[w]/include/uri: model://nowhere: no such file or directory" in strict.out
    for argument in ("shop.scenario.yaml", "shop.sdf"):
        lenient = simscen("validate", argument, "--lenient")
        assert lenient.code == 0
        assert "shop.sdf: warning[SC311] world[w]/include/uri: skipped: model://nowhere" in lenient.out


@pytest.mark.parametrize(
    ("arguments", "expected_text"),
    [
        (("one",), "name the scenarios to compare with the earlier session one"),
        (("good.scenario.yaml", "one", "two"), "--check-determinism compares with one earlier session only"),
        (("good.scenario.yaml", "one", "--check-against", "two"), "compares with one earlier session only"),
    ],
)
def test_determinism_is_checked_against_one_earlier_session(simscen, tmp_path: Path, arguments, expected_text) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "events.jsonl").write_text("")
    result = simscen("run", *arguments, "--check-determinism")
    assert result.code == 2
    assert expected_text in result.err
