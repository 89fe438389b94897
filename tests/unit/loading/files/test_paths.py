import os
from pathlib import Path

import pytest

from simscen.loading.files.paths import PathProblem, PathSandbox


@pytest.fixture
def fence(tmp_path: Path) -> PathSandbox:
    for name in ("root/sub/a.yaml", "root/b.yaml", "allowed/model/m.yaml", "outside/secret.yaml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x: 1")
    return PathSandbox.around(tmp_path / "root", [tmp_path / "allowed"])


def _refusal(fence: PathSandbox, written: str) -> PathProblem:
    found = fence.find(written, fence.root / "sub")
    assert isinstance(found, PathProblem)
    return found


def test_a_path_is_relative_to_the_file_it_stands_in(fence: PathSandbox) -> None:
    assert fence.find("a.yaml", fence.root / "sub") == fence.root / "sub/a.yaml"
    assert fence.find("../b.yaml", fence.root / "sub") == fence.root / "b.yaml"


def test_models_and_bare_paths_are_found_in_the_world_path(fence: PathSandbox) -> None:
    expected = fence.world_path[0] / "model/m.yaml"
    assert fence.find("model://model/m.yaml", fence.root) == expected
    assert fence.find("model/m.yaml", fence.root) == expected


@pytest.mark.parametrize("written", ["../../outside/secret.yaml", "../../outside/nothing.yaml", "../../../etc/passwd"])
def test_a_path_out_of_the_root_is_refused_whether_it_exists_or_not(fence: PathSandbox, written: str) -> None:
    assert _refusal(fence, written).code == "SC020"


@pytest.mark.parametrize("written", ["model://../outside/secret.yaml", "model://model/../../outside/secret.yaml"])
def test_a_model_cannot_climb_out_of_its_folder(fence: PathSandbox, written: str) -> None:
    assert _refusal(fence, written).code == "SC023"


@pytest.mark.parametrize(
    "written", ["/etc/passwd", "~/x.yaml", "~root/x", "C:/x", "file:///etc/passwd", "package://a/b", "http://x/y"]
)
def test_absolute_paths_and_urls_are_refused(fence: PathSandbox, written: str) -> None:
    assert _refusal(fence, written).code == "SC021"


def test_a_link_out_of_the_root_is_refused(fence: PathSandbox, tmp_path: Path) -> None:
    (fence.root / "sub/link.yaml").symlink_to(tmp_path / "outside/secret.yaml")
    (fence.root / "sub/folder").symlink_to(tmp_path / "outside")
    assert _refusal(fence, "link.yaml").code == "SC020"
    assert _refusal(fence, "folder/secret.yaml").code == "SC020"


def test_a_link_inside_the_root_is_followed(fence: PathSandbox) -> None:
    (fence.root / "sub/link.yaml").symlink_to("../b.yaml")
    assert fence.find("link.yaml", fence.root / "sub") == fence.root / "b.yaml"


def test_a_loop_of_links_is_told(fence: PathSandbox) -> None:
    (fence.root / "sub/one").symlink_to("two")
    (fence.root / "sub/two").symlink_to("one")
    refusal = _refusal(fence, "one")
    assert (refusal.code, refusal.message) == ("SC022", "symbolic link loop: `one`")


def test_a_near_name_is_suggested(fence: PathSandbox) -> None:
    refusal = _refusal(fence, "aa.yaml")
    assert (refusal.message, refusal.hint) == ("no such file or directory: `aa.yaml`", "did you mean `a.yaml`?")


@pytest.mark.parametrize(
    ("written", "code"),
    [("a\x00b", "SC017"), ("a\x1b[31m", "SC017"), ("x" * 5000, "SC023"), ("a.yaml/b", "SC023"), ("x/" * 2000, "SC023")],
)
def test_impossible_names_are_refused_without_an_exception(fence: PathSandbox, written: str, code: str) -> None:
    assert _refusal(fence, written).code == code


@pytest.mark.skipif(os.geteuid() == 0, reason="root may look everywhere")
def test_a_folder_that_may_not_be_searched_is_told(fence: PathSandbox) -> None:
    (fence.root / "locked").mkdir(mode=0)
    assert "permission denied" in _refusal(fence, "../locked/x.yaml").message
