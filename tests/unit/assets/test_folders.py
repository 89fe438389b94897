"""Tests of the search for referenced files in the allowed folders."""

import os
from pathlib import Path

import pytest

from simscen.assets.folders import AllowedFolders, NoSuchFile, UnusableFile


def create_file(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("x")
    return path


@pytest.fixture
def folders(tmp_path: Path) -> AllowedFolders:
    """A root called `root`, and a folder called `models` that the command line allows."""
    for name in ("root", "models"):
        (tmp_path / name).mkdir()
    return AllowedFolders.of([tmp_path / "root", tmp_path / "models"])


@pytest.mark.parametrize("scheme", ["package://", "model://"])
def test_packages_are_searched_in_the_documented_order(folders: AllowedFolders, scheme: str) -> None:
    root, models = folders.roots
    base_folder = root / "shop" / "worlds"
    found = []
    for folder in (root / "vendor" / "ros", root / "shop", models):
        create_file(folder / "cart" / "base.stl")
        found.append(folders.find(f"{scheme}cart/base.stl", base_folder).parents[1])
    assert found == [root / "vendor" / "ros", root / "shop", models]


@pytest.mark.parametrize("other", ["include/cart", "cart", "build/cart", "install/cart"])
def test_a_package_comes_before_other_folders_with_its_name(folders: AllowedFolders, other: str) -> None:
    root, _ = folders.roots
    create_file(root / "repository" / other / "cart.hpp")
    create_file(root / other / "cart.hpp")
    assert folders.package_folder("cart", root / "repository" / "urdf") != root / "repository"
    (root / "repository" / "package.xml").write_text("<package><name>cart</name></package>")
    assert folders.package_folder("cart", root / "repository" / "urdf") == root / "repository"


def test_a_package_is_found_by_the_name_in_its_package_xml(folders: AllowedFolders) -> None:
    root, _ = folders.roots
    mesh = create_file(root / "src" / "cart_repository" / "base.stl")
    manifest = mesh.parent / "package.xml"
    manifest.write_text("<package><!-- <name>other</name> -->\n <name> cart </name></package>")
    assert folders.find("package://cart/base.stl", root / "worlds") == mesh
    assert folders.find("package://cart/base.stl", mesh.parent / "urdf") == mesh
    assert folders.package_folder("cart", root) == mesh.parent
    with pytest.raises(NoSuchFile):
        folders.package_folder("other", root)


def test_a_package_xml_behind_a_link_is_not_read(folders: AllowedFolders, tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "package.xml").write_text("<package><name>cart</name></package>")
    (folders.roots[0] / "linked").symlink_to(outside)
    with pytest.raises(NoSuchFile):
        folders.package_folder("cart", folders.roots[0])


def test_the_search_for_missing_packages_lists_each_folder_once(
    folders: AllowedFolders, monkeypatch: pytest.MonkeyPatch
) -> None:
    root, models = folders.roots
    create_file(root / "robots" / "cart" / "base.stl")
    (root / "round").symlink_to(root / "round")
    listed, scandir = [], os.scandir
    monkeypatch.setattr(os, "scandir", lambda path: listed.append(Path(path)) or scandir(path))
    for name in ("one", "two", "three"):
        with pytest.raises(NoSuchFile):
            folders.package_folder(name, root)
    assert folders.package_folder("cart", models) == root / "robots" / "cart"
    assert sorted(listed) == sorted([root, models, root / "robots"])


def test_a_package_with_a_specified_path_is_not_searched(folders: AllowedFolders, tmp_path: Path) -> None:
    root, models = folders.roots
    create_file(models / "cart" / "base.stl")
    file = create_file(root / "vendor" / "base.stl")
    with_package_path = AllowedFolders(folders.roots, {"cart": root / "vendor"})
    assert with_package_path.find("package://cart/base.stl", root) == file
    with pytest.raises(NoSuchFile, match="no such file"):
        with_package_path.find("package://cart/wheel.stl", root)


@pytest.mark.parametrize("uri", ["base.stl", "file://base.stl", "./base.stl"])
def test_relative_path_is_searched_next_to_the_file_first(folders: AllowedFolders, uri: str) -> None:
    root, models = folders.roots
    distant_file = create_file(models / "base.stl")
    assert folders.find(uri, root) == distant_file
    adjacent_file = create_file(root / "base.stl")
    assert folders.find(uri, root) == adjacent_file


def test_file_with_a_no_break_space_in_its_name_is_found(folders: AllowedFolders, tmp_path: Path) -> None:
    file = create_file(tmp_path / "root/a\u00a0b.stl")
    assert folders.find(file.name, file.parent) == file


@pytest.mark.parametrize(
    ("uri", "message"),
    [
        ("", "the URI is empty"),
        ("a\nb", "the URI contains a control character"),
        ("a" * 1001, "not a usable path"),
        ("https://example.org/a.stl", "only model://, package://, file://, Fuel and relative paths are read"),
        ("package://", "the name of a model is missing"),
        ("model:///", "the name of a model is missing"),
        ("/etc/passwd", "absolute paths are not read"),
        ("file:///etc/passwd", "absolute paths are not read"),
        ("../secret.stl", "outside the scenario root and the world paths"),
        ("../nothing.stl", "outside the scenario root and the world paths"),
        ("model://../secret.stl", "outside the scenario root and the world paths"),
        ("link.stl", "outside the scenario root and the world paths"),
        ("round.stl", "symbolic link loop"),
    ],
)
def test_missing_file_message_reveals_nothing_outside(
    folders: AllowedFolders, tmp_path: Path, uri: str, message: str
) -> None:
    root, _ = folders.roots
    create_file(tmp_path / "secret.stl")
    (root / "link.stl").symlink_to(tmp_path / "secret.stl")
    (root / "round.stl").symlink_to(root / "round.stl")
    with pytest.raises(UnusableFile) as caught:
        folders.find(uri, root)
    assert str(caught.value) == message


def test_an_absolute_path_inside_the_root_is_read_if_allowed(folders: AllowedFolders) -> None:
    distant_file = create_file(folders.roots[0] / "base.stl")
    assert folders.find(str(distant_file), folders.roots[1], allow_absolute=True) == distant_file
    with pytest.raises(UnusableFile, match="outside"):
        folders.find("/etc/passwd", folders.roots[1], allow_absolute=True)


def test_missing_file_message_lists_similar_files(folders: AllowedFolders) -> None:
    root, models = folders.roots
    create_file(models / "cart" / "Base.stl")
    with pytest.raises(NoSuchFile) as caught:
        folders.find("package://cart/base.stl", root)
    assert caught.value.hint == "did you mean `cart/Base.stl`?"
    with pytest.raises(NoSuchFile) as caught:
        folders.find("hull.stl", root)
    assert caught.value.hint == f"looked in ., {models}; allow its folder with --world-path"


def test_hint_without_allowed_folders_lists_none(tmp_path: Path) -> None:
    with pytest.raises(NoSuchFile) as caught:
        AllowedFolders.of([tmp_path]).find("model://cart", tmp_path)
    assert caught.value.hint == "allow its folder with --world-path"


def test_hint_for_a_file_that_its_package_lacks_names_the_package(tmp_path: Path) -> None:
    create_file(tmp_path / "vendor" / "cart" / "package.xml")
    with pytest.raises(NoSuchFile) as caught:
        AllowedFolders.of([tmp_path]).find("package://cart/meshes/base.stl", tmp_path)
    assert caught.value.hint == "the folder of its package is vendor/cart"


def test_a_package_name_that_is_too_long_for_a_folder_is_refused(folders: AllowedFolders) -> None:
    with pytest.raises(UnusableFile, match="is not the name of a package"):
        folders.package_folder("a" * 300, folders.roots[0])
