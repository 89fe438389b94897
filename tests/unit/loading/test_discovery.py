from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput, NothingSelected
from simscen.loading.discovery import default_root, discover


def _touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("")


def test_a_folder_is_searched_in_order_and_a_file_may_have_any_name(tmp_path: Path) -> None:
    _touch(
        tmp_path,
        "b.scenario.yaml",
        "a/z.scenario.yaml",
        "a/y.scenario.yml",
        "a.world.yaml",
        "x.yaml",
        ".git/c.scenario.yaml",
    )
    found = discover([tmp_path, tmp_path / "x.yaml", tmp_path / "b.scenario.yaml"], tmp_path)
    assert [str(file.relative_to(tmp_path)) for file in found] == [
        "a/y.scenario.yml", "a/z.scenario.yaml", "b.scenario.yaml", "x.yaml"
    ]  # fmt: skip


def test_missing_paths_are_all_told(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as raised:
        discover([tmp_path / "no", tmp_path, tmp_path / ("x" * 5000)], tmp_path)
    assert [p.message for p in raised.value.problems] == [
        "no such file or directory",
        "the name is too long",
    ]


def test_nothing_found_is_not_success(tmp_path: Path) -> None:
    _touch(tmp_path, "a.yaml")
    with pytest.raises(NothingSelected, match="no scenarios found"):
        discover([tmp_path], tmp_path)


def test_ids_that_differ_only_in_case_are_refused(tmp_path: Path) -> None:
    _touch(tmp_path, "Goal.scenario.yaml", "goal.scenario.yaml", "other.scenario.yaml")
    with pytest.raises(InvalidInput) as raised:
        discover([tmp_path], tmp_path)
    assert [(p.code, p.path) for p in raised.value.problems] == [("SC040", "goal.scenario.yaml")]


def test_the_root_is_the_repository_or_else_the_common_folder(tmp_path: Path) -> None:
    _touch(tmp_path, "a/b/x.yaml", "a/c/y.yaml")
    paths = [tmp_path / "a/b/x.yaml", tmp_path / "a/c"]
    assert default_root(paths) == tmp_path / "a"
    assert default_root(paths[:1]) == tmp_path / "a/b"
    (tmp_path / ".git").mkdir()
    assert default_root(paths) == tmp_path


def test_a_loop_of_folders_is_not_followed(tmp_path: Path) -> None:
    _touch(tmp_path, "a/x.scenario.yaml")
    (tmp_path / "a/again").symlink_to(tmp_path / "a")
    assert len(discover([tmp_path], tmp_path)) == 1
