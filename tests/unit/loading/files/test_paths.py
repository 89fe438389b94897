"""Tests of the paths of files, which must be inside the root or the world path."""

import os
from pathlib import Path

import pytest

from simscen.core.errors import Problem
from simscen.loading.files.paths import PathSandbox
from simscen.loading.yaml.tree import Position

POSITION = Position("a.yaml", 1, 1)


@pytest.fixture
def sandbox(tmp_path: Path) -> PathSandbox:
    for name in ("root/sub/a.yaml", "root/b.yaml", "allowed/model/m.yaml", "outside/secret.yaml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x: 1")
    return PathSandbox.around(tmp_path / "root", [tmp_path / "allowed"])


def _refusal(sandbox: PathSandbox, written: str) -> Problem:
    found = sandbox.find(written, sandbox.root / "sub", POSITION)
    assert isinstance(found, Problem)
    return found


def test_path_is_relative_to_the_file_that_contains_it(sandbox: PathSandbox) -> None:
    assert sandbox.find("a.yaml", sandbox.root / "sub", POSITION) == sandbox.root / "sub/a.yaml"
    assert sandbox.find("../b.yaml", sandbox.root / "sub", POSITION) == sandbox.root / "b.yaml"


@pytest.mark.parametrize("name", ["bu\u0308ro\u00a01.yaml", "at 9.41\u202fAM.yaml", "b\u3000c.yaml"])
def test_file_names_can_contain_all_kinds_of_spaces(sandbox: PathSandbox, name: str) -> None:
    (sandbox.root / name).write_text("x: 1")
    assert sandbox.find(name, sandbox.root, POSITION) == sandbox.root / name


def test_models_and_bare_paths_are_found_in_the_world_path(sandbox: PathSandbox) -> None:
    expected = sandbox.world_path[0] / "model/m.yaml"
    assert sandbox.find("model://model/m.yaml", sandbox.root, POSITION) == expected
    assert sandbox.find("model/m.yaml", sandbox.root, POSITION) == expected


@pytest.mark.parametrize("written", ["../../outside/secret.yaml", "../../outside/nothing.yaml", "../../../etc/passwd"])
def test_a_path_out_of_the_root_is_refused_whether_it_exists_or_not(sandbox: PathSandbox, written: str) -> None:
    assert _refusal(sandbox, written).code == "SC020"


@pytest.mark.parametrize("written", ["model://../outside/secret.yaml", "model://model/../../outside/secret.yaml"])
def test_a_model_cannot_climb_out_of_its_folder(sandbox: PathSandbox, written: str) -> None:
    assert _refusal(sandbox, written).code == "SC023"


@pytest.mark.parametrize(
    "written", ["/etc/passwd", "~/x.yaml", "~root/x", "C:/x", "file:///etc/passwd", "package://a/b", "http://x/y"]
)
def test_absolute_paths_and_urls_are_refused(sandbox: PathSandbox, written: str) -> None:
    assert _refusal(sandbox, written).code == "SC021"


def test_a_link_out_of_the_root_is_refused(sandbox: PathSandbox, tmp_path: Path) -> None:
    (sandbox.root / "sub/link.yaml").symlink_to(tmp_path / "outside/secret.yaml")
    (sandbox.root / "sub/folder").symlink_to(tmp_path / "outside")
    assert _refusal(sandbox, "link.yaml").code == "SC020"
    assert _refusal(sandbox, "folder/secret.yaml").code == "SC020"


def test_a_link_inside_the_root_is_followed(sandbox: PathSandbox) -> None:
    (sandbox.root / "sub/link.yaml").symlink_to("../b.yaml")
    assert sandbox.find("link.yaml", sandbox.root / "sub", POSITION) == sandbox.root / "b.yaml"


def test_a_loop_of_links_is_reported(sandbox: PathSandbox) -> None:
    (sandbox.root / "sub/one").symlink_to("two")
    (sandbox.root / "sub/two").symlink_to("one")
    refusal = _refusal(sandbox, "one")
    assert (refusal.code, refusal.message) == ("SC022", "symbolic link loop: `one`")


def test_a_near_name_is_suggested(sandbox: PathSandbox) -> None:
    refusal = _refusal(sandbox, "aa.yaml")
    assert (refusal.message, refusal.hint) == ("no such file or directory: `aa.yaml`", "did you mean `a.yaml`?")


@pytest.mark.parametrize(
    ("written", "code"),
    [("a\x00b", "SC017"), ("a\x1b[31m", "SC017"), ("x" * 5000, "SC023"), ("a.yaml/b", "SC023"), ("x/" * 2000, "SC023")],
)
def test_invalid_file_names_are_refused(sandbox: PathSandbox, written: str, code: str) -> None:
    assert _refusal(sandbox, written).code == code


@pytest.mark.skipif(os.geteuid() == 0, reason="root may look everywhere")
def test_a_folder_without_search_permission_is_reported(sandbox: PathSandbox) -> None:
    (sandbox.root / "locked").mkdir(mode=0)
    assert "permission denied" in _refusal(sandbox, "../locked/x.yaml").message
