"""Tests of `extends`, default values, and the merging of files."""

from pathlib import Path
from typing import Any

import pytest

from simscen.core.errors import Problem
from simscen.loading.files.paths import PathSandbox
from simscen.loading.yaml.library import Library


def _read(folder: Path, files: dict[str, str], defaults: bool = False) -> tuple[Any, list[Problem], Library]:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    library = Library(PathSandbox.around(folder))
    tree, problems = library.read(folder / next(iter(files)), defaults)
    return tree and tree.plain, problems, library


def test_own_keys_win_over_what_is_extended_and_that_over_defaults(tmp_path: Path) -> None:
    files = {
        "a.yaml": "extends: base/b.yaml\nx: {own: 1}\n",
        "base/b.yaml": "extends: c.yaml\nx: {own: 2, base: 2}\nlist: [1]\n",
        "base/c.yaml": "x: {deep: 3}\nlist: [7, 8]\n",
        "defaults.yaml": "x: {own: 4, base: 4, deep: 4, default: 4}\n",
    }
    plain, problems, _ = _read(tmp_path, files, defaults=True)
    assert not problems
    assert plain == {"x": {"own": 1, "base": 2, "deep": 3, "default": 4}, "list": [1]}


def test_defaults_are_only_read_when_asked_for(tmp_path: Path) -> None:
    plain, _, _ = _read(tmp_path, {"a.yaml": "x: 1", "defaults.yaml": "y: 2"})
    assert plain == {"x": 1}


def test_a_mapping_of_another_type_is_replaced_not_merged(tmp_path: Path) -> None:
    files = {
        "a.yaml": "extends: b.yaml\ncontroller: {type: dwb}\nlocalizer: {alpha1: 1}\n",
        "b.yaml": "controller: {type: mppi, gamma: 1}\nlocalizer: {type: amcl, alpha2: 2}\n",
    }
    plain, _, _ = _read(tmp_path, files)
    assert plain["controller"] == {"type": "dwb"}
    assert plain["localizer"] == {"type": "amcl", "alpha1": 1, "alpha2": 2}


@pytest.mark.parametrize(
    ("own", "expected"),
    [
        ("{controller_frequency: 5}", {"external": "mine", "ground_truth": True, "controller_frequency": 5}),
        ("{type: reference}", {"type": "reference"}),
        ("{external: other}", {"external": "other", "ground_truth": True}),
    ],
)
def test_an_external_stack_is_replaced_by_one_with_a_type(own, expected, tmp_path: Path) -> None:
    files = {"a.yaml": f"extends: b.yaml\nstack: {own}\n", "b.yaml": "stack: {external: mine, ground_truth: true}\n"}
    assert _read(tmp_path, files)[0]["stack"] == expected


def test_places_stay_in_the_file_they_were_written_in(tmp_path: Path) -> None:
    library = _read(tmp_path, {"a.yaml": "extends: sub/b.yaml\n", "sub/b.yaml": "\nworld: w.yaml\n"})[2]
    tree, _ = library.read(tmp_path / "a.yaml")
    assert tree is not None
    place = tree.entries["world"].value.position  # type: ignore[union-attr]
    assert place == ("sub/b.yaml", 2, 8)
    assert library.find("b.yaml", place) == tmp_path / "sub/b.yaml"


def test_a_circle_is_printed_as_a_chain(tmp_path: Path) -> None:
    files = {"a.yaml": "extends: b.yaml", "b.yaml": "extends: c.yaml", "c.yaml": "extends: a.yaml"}
    _, problems, _ = _read(tmp_path, files)
    assert [p.message for p in problems] == ["circular `extends`: a.yaml → b.yaml → c.yaml → a.yaml"]


def test_a_file_may_not_extend_itself(tmp_path: Path) -> None:
    _, problems, _ = _read(tmp_path, {"a.yaml": "extends: a.yaml"})
    assert "a.yaml → a.yaml" in problems[0].message


def test_a_long_chain_is_refused(tmp_path: Path) -> None:
    files = {f"{i}.yaml": f"extends: {i + 1}.yaml" for i in range(40)}
    _, problems, _ = _read(tmp_path, files)
    assert [p.message for p in problems] == ["a scenario can consist of at most 32 YAML files"]


def test_extends_names_one_file(tmp_path: Path) -> None:
    for text in ("extends: [a.yaml]", "extends: 3", "extends:"):
        _, problems, _ = _read(tmp_path, {"a.yaml": text})
        assert [p.code for p in problems] == ["SC011"]


def test_extended_files_must_be_inside_the_root(tmp_path: Path) -> None:
    (tmp_path / "outside.yaml").write_text("secret: 1")
    (tmp_path / "root").mkdir()
    plain, problems, _ = _read(tmp_path / "root", {"a.yaml": "extends: ../outside.yaml"})
    assert plain == {}
    assert [p.code for p in problems] == ["SC020"]


def test_mistakes_in_every_file_are_reported(tmp_path: Path) -> None:
    files = {"a.yaml": "extends: b.yaml\nx: 1\nx: 2\n", "b.yaml": "y: !t 3\n", "defaults.yaml": "- 1"}
    _, problems, _ = _read(tmp_path, files, defaults=True)
    assert [(p.path, p.code) for p in problems] == [
        ("a.yaml", "SC007"), ("b.yaml", "SC005"), ("defaults.yaml", "SC004")
    ]  # fmt: skip


def test_problems_get_the_text_of_their_line(tmp_path: Path) -> None:
    _, problems, library = _read(tmp_path, {"a.yaml": "x: 1\nx: 2\n"})
    assert library.with_source(problems)[0].source == "x: 2"


@pytest.mark.parametrize(
    ("own", "base", "defaults", "expected"),
    [
        ("pass+: [3]", "pass: [1]", "pass: [2]", {"pass": [1, 3]}),
        ("pass+: [3]", "pass+: [1]", "pass: [2]", {"pass": [2, 1, 3]}),
        ("pass+: [3]", "tags: []", "pass: [2]", {"pass": [2, 3], "tags": []}),
        ("pass: [3]", "pass: [1]", "pass: [2]", {"pass": [3]}),
        ("pass+: [3]", "tags: []", "tags: [2]", {"pass+": [3], "tags": []}),
        ("pass: [3]\npass+: [4]", "pass: [1]", "tags: []", {"pass": [3], "pass+": [4], "tags": []}),
        ("x: {y+: [3]}", "x: {y: [1]}", "tags: []", {"x": {"y+": [3], "y": [1]}, "tags": []}),
    ],
)  # fmt: skip
def test_a_key_with_a_plus_adds_to_the_list_of_the_file_below(own, base, defaults, expected, tmp_path) -> None:
    for name, text in {"own": f"extends: base.yaml\n{own}", "base": base, "defaults": defaults}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    tree, problems = Library(PathSandbox.around(tmp_path)).read(tmp_path / "own.yaml", defaults=True)
    assert problems == []
    assert tree.plain == expected
