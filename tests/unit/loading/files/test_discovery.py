"""Tests of the search for scenarios, of the root, and of the IDs of scenarios."""

import os
import shutil
from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput, NothingSelected
from simscen.loading.files.discovery import default_root, discover
from tests.scenario_files import try_scenario

SHIPPED = Path(__file__).parents[4]


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


def test_all_missing_paths_are_reported(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as raised:
        discover([tmp_path / "no", tmp_path, tmp_path / ("x" * 5000)], tmp_path)
    assert [p.message for p in raised.value.problems] == [
        "no such file or directory",
        "the name is too long",
    ]


def test_empty_selection_is_an_error(tmp_path: Path) -> None:
    _touch(tmp_path, "a.yaml")
    with pytest.raises(NothingSelected, match="no scenarios found"):
        discover([tmp_path], tmp_path)


def test_ids_that_differ_only_in_case_are_refused(tmp_path: Path) -> None:
    _touch(tmp_path, "Goal.scenario.yaml", "goal.scenario.yaml", "other.scenario.yaml")
    with pytest.raises(InvalidInput) as raised:
        discover([tmp_path], tmp_path)
    assert [(p.code, p.path) for p in raised.value.problems] == [("SC040", "goal.scenario.yaml")]


@pytest.fixture
def elsewhere(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, which holds nothing."""
    folder = tmp_path_factory.mktemp("elsewhere")
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.usefixtures("elsewhere")
def test_the_root_is_the_repository_or_else_the_common_folder(tmp_path: Path) -> None:
    _touch(tmp_path, "a/b/x.yaml", "a/c/y.yaml")
    paths = [tmp_path / "a/b/x.yaml", tmp_path / "a/c"]
    assert default_root(paths) == tmp_path / "a"
    assert default_root(paths[:1]) == tmp_path / "a/b"
    (tmp_path / ".git").mkdir()
    assert default_root(paths) == tmp_path


@pytest.mark.usefixtures("elsewhere")
@pytest.mark.parametrize("file", ["pyproject.toml", "package.xml", "setup.py"])
def test_an_archive_without_its_repository_is_known_by_its_project_file(tmp_path: Path, file: str) -> None:
    _touch(tmp_path, "p/sim/nav/x.yaml", f"p/{file}", "package.xml")
    assert default_root([tmp_path / "p/sim/nav/x.yaml"]) == tmp_path / "p"
    (tmp_path / ".git").mkdir()
    assert default_root([tmp_path / "p/sim/nav/x.yaml"]) == tmp_path, "a repository of several packages is one root"


@pytest.mark.usefixtures("elsewhere")
def test_parent_of_a_scenarios_folder_is_the_project(tmp_path: Path) -> None:
    _touch(tmp_path, "p/scenarios/faults/x.yaml", "p/worlds/hall.world.yaml")
    for path in ("p/scenarios/faults/x.yaml", "p/scenarios/faults", "p/scenarios"):
        assert default_root([tmp_path / path]) == tmp_path / "p"


def test_working_folder_is_the_project_of_its_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _touch(tmp_path, "p/sim/x.yaml", "p/worlds/hall.world.yaml", "q/x.yaml")
    monkeypatch.chdir(tmp_path / "p")
    assert default_root([Path("sim/x.yaml")]) == tmp_path / "p"
    assert default_root([tmp_path / "q/x.yaml"]) == tmp_path / "q"


@pytest.mark.parametrize("home", ["user", "user/deep"])
def test_home_folder_and_its_parents_are_no_project_roots(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, home: str
) -> None:
    _touch(tmp_path, "user/down/x.yaml", "user/scenarios/y.yaml", "user/deep/z.yaml", "user/.ssh/id")
    monkeypatch.setenv("HOME", str(tmp_path / home))
    monkeypatch.chdir(tmp_path / "user")
    assert default_root([Path("down/x.yaml")]) == tmp_path / "user/down"
    assert default_root([Path("scenarios/y.yaml")]) == tmp_path / "user/scenarios"
    monkeypatch.chdir("/")
    assert default_root([tmp_path / "user/down/x.yaml"]) == tmp_path / "user/down"


def test_copied_shipped_scenarios_are_valid_from_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A Docker image holds them without .git; from there every command ended with SC020 and exit code 2."""
    for name in ("scenarios", "worlds"):
        shutil.copytree(SHIPPED / name, tmp_path / "copy" / name)
    one = tmp_path / "copy/scenarios/faults/lidar_off.scenario.yaml"
    for folder in ("copy", "copy/scenarios", "copy/scenarios/faults", "."):
        monkeypatch.chdir(tmp_path / folder)
        for path in (tmp_path / "copy/scenarios", one):
            argument = Path(os.path.relpath(path))
            root = default_root([argument])
            assert root == tmp_path / "copy"
            files = discover([argument], root)
            assert len(files) == (1 if path == one else len(list(path.rglob("*.scenario.yaml"))))
            # All of them once; of how they are called a single file shows as much.
            problems = [try_scenario(file, root) for file in (files if folder == "copy" else files[:1])]
            assert not [found for found in problems if isinstance(found, list)]


def test_a_loop_of_folders_is_not_followed(tmp_path: Path) -> None:
    _touch(tmp_path, "a/x.scenario.yaml")
    (tmp_path / "a/again").symlink_to(tmp_path / "a")
    assert len(discover([tmp_path], tmp_path)) == 1


def test_runs_of_two_scenarios_have_no_folder_in_common(tmp_path: Path) -> None:
    _touch(
        tmp_path,
        "a.scenario.yaml",
        "a/seed-1/map.png.scenario.yaml",
        "b/seed-1/x.scenario.yaml",
        "seed-2.scenario.yaml",
    )
    with pytest.raises(InvalidInput) as raised:
        discover([tmp_path], tmp_path)
    (problem,) = raised.value.problems
    assert (problem.path, problem.code) == ("a/seed-1/map.png.scenario.yaml", "SC041")
    assert problem.message == "its output folder would be the folder of a run of `a`"


@pytest.mark.parametrize("others", [[], ["good.scenario.yaml"]])
def test_an_empty_folder_with_the_name_of_a_scenario_is_invalid(tmp_path, others):
    (tmp_path / "x.scenario.yaml").mkdir()
    (tmp_path / "good.scenario.yaml").touch()
    with pytest.raises(InvalidInput, match=r"x\.scenario\.yaml: is a folder"):
        discover([tmp_path / name for name in ["x.scenario.yaml", *others]], tmp_path)


def test_links_in_the_path_of_a_folder_are_resolved(tmp_path: Path) -> None:
    _touch(tmp_path, "project/a/goal.scenario.yaml", "project/b/goal.scenario.yaml")
    (tmp_path / "link").symlink_to(tmp_path / "project")
    project = tmp_path / "project"
    expected = [project / "a" / "goal.scenario.yaml", project / "b" / "goal.scenario.yaml"]
    assert discover([tmp_path / "link", project / "a" / ".." / "b"], tmp_path / "link") == expected


def test_a_link_to_a_scenario_keeps_its_own_name(tmp_path: Path) -> None:
    _touch(tmp_path, "shared/goal.scenario.yaml")
    link = tmp_path / "own.scenario.yaml"
    link.symlink_to(tmp_path / "shared" / "goal.scenario.yaml")
    assert discover([link], tmp_path) == [link]
