"""Tests of `simscen new`: new scenarios, copies, and base files."""

import shlex
from pathlib import Path

import pytest


@pytest.mark.parametrize("name", ["aisle", "aisle.scenario.yaml", "deep/er/aisle"])
def test_new_writes_a_valid_scenario(simscen, tmp_path: Path, name: str) -> None:
    assert simscen("new", name).code == 0
    written = f"{name.removesuffix('.scenario.yaml')}.scenario.yaml"
    assert simscen("validate", written) == (0, "1 scenario is valid\n", "")
    assert (tmp_path / written).read_text().count("#") >= 8


def test_suggested_command_works_for_a_name_with_spaces(simscen, tmp_path: Path) -> None:
    suggestion = simscen("new", "narrow aisle").out.rstrip().partition("; try: ")[2]
    assert shlex.split(suggestion) == ["simscen", "run", "narrow aisle.scenario.yaml"]


def test_verification_does_not_overwrite_the_recorded_log(simscen, tmp_path: Path) -> None:
    assert simscen("run", "good.scenario.yaml", "--out", "out").code == 0
    log = Path("out/runs/good/seed-1/run.mcap").rename("drive.verified.mcap")
    original = log.read_bytes()
    result = simscen("new", "drive", "--from-log", log, "--verify")
    assert result.code == 2
    assert "cannot write drive.verified.mcap: it is one of the input files" in result.err
    assert log.read_bytes() == original


def test_new_never_overwrites_a_file(simscen, tmp_path: Path) -> None:
    (tmp_path / "mine.scenario.yaml").write_text("precious")
    result = simscen("new", "mine")
    assert result.code == 2
    assert "mine.scenario.yaml already exists" in result.err
    assert (tmp_path / "mine.scenario.yaml").read_text() == "precious"


@pytest.mark.parametrize("name", ["good.scenario.yaml/x", "x" * 300, "a\x00b"])
def test_invalid_name_is_a_usage_error(simscen, name: str) -> None:
    result = simscen("new", name)
    assert result.code == 2
    assert "Traceback" not in result.err


def test_copy_of_a_shipped_scenario_is_complete_and_valid(simscen, tmp_path: Path) -> None:
    result = simscen("new", "mine", "--like", "outdated_map")
    assert result.code == 0
    assert {path.relative_to(tmp_path).as_posix() for path in (tmp_path / "mine").rglob("*")} == {
        "mine/house.world.yaml", "mine/house_last_year.yaml", "mine/house_last_year.pgm"
    }  # fmt: skip
    assert "map: mine/house_last_year.yaml" in (tmp_path / "mine.scenario.yaml").read_text()
    assert simscen("validate", "mine.scenario.yaml").code == 0


def test_copy_in_the_same_project_keeps_files_and_comments(simscen, tmp_path: Path) -> None:
    (tmp_path / ".git").mkdir()
    (tmp_path / "here.world.yaml").write_text("simscen: 1\nplaces: {dock: {x: 0, y: 0}, desk: {x: 2, y: 0}}\n")
    text = "simscen: 1\n# why\nworld: 'here.world.yaml'  # there\nrobot: {pose: dock}\n"
    (tmp_path / "one.scenario.yaml").write_text(f"{text}goals: [desk]\npass: [{{goals_reached: {{}}}}]\n")
    assert simscen("new", "deep/two", "--like", "one.scenario.yaml").code == 0
    copied = (tmp_path / "deep" / "two.scenario.yaml").read_text()
    assert copied.startswith("simscen: 1\n# why\nworld: '../here.world.yaml'  # there\n")
    assert simscen("validate", "deep/two.scenario.yaml").code == 0
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["two.scenario.yaml"]


@pytest.mark.parametrize(
    ("like", "expected_text"),
    [("outdated_mop", "did you mean `navigation/outdated_map`"), ("cart_crossing", "is ambiguous")],
)
def test_unknown_or_ambiguous_scenario_to_copy_is_an_error(simscen, like: str, expected_text: str) -> None:
    result = simscen("new", "mine", "--like", like)
    assert (result.code, expected_text in result.err) == (2, True), result.err
    assert not Path("mine.scenario.yaml").exists()


def test_copy_overwrites_nothing(simscen, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "house.world.yaml").write_text("precious")
    assert simscen("new", "mine", "--like", "navigation/goal").code == 2
    assert (tmp_path / "mine" / "house.world.yaml").read_text() == "precious"
    assert not (tmp_path / "mine.scenario.yaml").exists()


@pytest.mark.parametrize("name", ["aisle.base.yaml", "deep/defaults.yaml"])
def test_base_file_refers_to_the_partial_schema(simscen, tmp_path: Path, name: str) -> None:
    (tmp_path / "pyproject.toml").write_text("")
    assert simscen("schema", "--write", "schemas").code == 0
    assert simscen("new", name).code == 0
    up = "../" * name.count("/")
    assert (tmp_path / name).read_text().startswith(f"# yaml-language-server: $schema={up}schemas/base.schema.json\n")
    assert simscen("validate", name) == (0, "1 base is valid\n", "")
    assert simscen("new", "mine").code == 0
    assert "$schema=schemas/scenario.schema.json" in (tmp_path / "mine.scenario.yaml").read_text().split("\n")[0]


def test_copy_includes_variations(simscen, tmp_path: Path) -> None:
    assert simscen("new", "mine", "--like", "speeds").code == 0
    output = simscen("list", "mine.scenario.yaml").out
    assert output.count("mine[desired_linear_vel=") == 4
