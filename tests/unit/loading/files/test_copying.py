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


def test_each_named_file_is_searched_once_and_unreadable_files_are_copied_as_they_are(
    write: Write, scenario: str, tmp_path: Path
) -> None:
    names = [f"{number}.yaml" for number in range(12)]
    for name in names:
        write(f"a/{name}", f"[{', '.join(names)}, latin.yaml]\n")
    (tmp_path / "a" / "latin.yaml").write_bytes("caf\u00e9".encode("latin-1"))
    text = scenario.replace("room.", "../room.").replace("cube.", "../cube.")
    loaded = load_scenario(write("a/a.scenario.yaml", f"{text}description: 0.yaml\n"), tmp_path)
    copies = copy_scenario(loaded, tmp_path / "new" / "b.scenario.yaml", tmp_path / "new")
    copied = {copy.name for copy in copies}
    assert copied == {"b.scenario.yaml", "room.world.yaml", "cube.robot.yaml", "latin.yaml", *names}
