"""Tests that problems name files relative to the working folder, although scenarios use paths from their root."""

from pathlib import Path

import pytest

from simscen import simulate, variations
from simscen.core.errors import InvalidInput

INVALID_WORLD = "simscen: 1\nwalls: 3\n"


def subfolder(root: Path) -> Path:
    """Return a subfolder of a Git repository, which is the scenario root, with a valid and an invalid scenario."""
    folder = root / "sub"
    folder.mkdir()
    (root / ".git").mkdir()
    scenario = (root / "good.scenario.yaml").read_text()
    (folder / "good.scenario.yaml").write_text(scenario)
    (folder / "bad.scenario.yaml").write_text(scenario.replace("name: drive", "nam: drive"))
    return folder


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        (["list", "."], "bad.scenario.yaml:2:1"),
        (["new", "copy", "--like", "bad.scenario.yaml"], "bad.scenario.yaml:2:1"),
        (["study", "variations.scenario.yaml"], "variations.scenario.yaml:11:"),
        (["falsify", "good.scenario.yaml"], "good.scenario.yaml:"),
        (["shrink", "bad.scenario.yaml"], "bad.scenario.yaml:2:1"),
        (["robot", "check", "bad.robot.yaml"], "bad.robot.yaml:1:1"),
        (["world", "inspect", "bad.world.yaml"], "bad.world.yaml:2:8"),
        (["world", "export", "bad.world.yaml", "--map", "map.yaml"], "bad.world.yaml:2:8"),
        (["world", "convert", "bad.world.yaml", "new.world.yaml"], "bad.world.yaml:2:8"),
        (["edit", "new", "--new", "--map", "bad.world.yaml"], "bad.world.yaml:2:8"),
    ],
)
def test_problems_of_a_file_in_a_subfolder_name_the_path_from_the_working_folder(
    simscen, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], place: str
) -> None:
    folder = subfolder(tmp_path)
    scenario = (folder / "good.scenario.yaml").read_text()
    (folder / "variations.scenario.yaml").write_text(scenario + "variations: {grid: 3}\n")
    (folder / "bad.robot.yaml").write_text("simscen: 1\n")
    (folder / "bad.world.yaml").write_text(INVALID_WORLD)
    monkeypatch.chdir(folder)
    result = simscen(*arguments)
    assert result.code == 2
    assert result.err.startswith(place), result.err


@pytest.mark.usefixtures("simscen")
@pytest.mark.parametrize("function", [simulate, variations])
def test_exceptions_of_the_python_interface_name_the_path_from_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, function
) -> None:
    monkeypatch.chdir(subfolder(tmp_path))
    with pytest.raises(InvalidInput, match=r"^bad\.scenario\.yaml:2:1"):
        function("bad.scenario.yaml")
