"""Tests of copies of scenarios and of the files that they name."""

from collections.abc import Callable
from pathlib import Path

from simscen.loading.files.copying import copy_scenario
from simscen.loading.scenario import load_scenario

Write = Callable[[str, str], Path]


def test_texts_that_are_too_long_for_a_path_are_no_files(write: Write, scenario: str, tmp_path: Path) -> None:
    text = f"{scenario}description: '{'A long sentence. ' * 30}'\n"
    loaded = load_scenario(write("a.scenario.yaml", text), tmp_path)
    assert copy_scenario(loaded, tmp_path / "b.scenario.yaml", tmp_path) == [tmp_path / "b.scenario.yaml"]
    assert (tmp_path / "b.scenario.yaml").read_text() == text
