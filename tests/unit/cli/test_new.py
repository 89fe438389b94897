from pathlib import Path

import pytest


@pytest.mark.parametrize("name", ["aisle", "aisle.scenario.yaml", "deep/er/aisle"])
def test_writes_a_valid_scenario(simscen, tmp_path: Path, name: str) -> None:
    assert simscen("new", name).code == 0
    written = f"{name.removesuffix('.scenario.yaml')}.scenario.yaml"
    assert simscen("validate", written) == (0, "1 scenario is valid\n", "")
    assert (tmp_path / written).read_text().count("#") >= 8


def test_never_overwrites(simscen, tmp_path: Path) -> None:
    (tmp_path / "mine.scenario.yaml").write_text("precious")
    ended = simscen("new", "mine")
    assert ended.code == 2
    assert "mine.scenario.yaml is there already" in ended.err
    assert (tmp_path / "mine.scenario.yaml").read_text() == "precious"


@pytest.mark.parametrize("name", ["good.scenario.yaml/x", "x" * 300, "a\x00b"])
def test_an_impossible_name_is_a_usage_error(simscen, name: str) -> None:
    ended = simscen("new", name)
    assert ended.code == 2
    assert "Traceback" not in ended.err
