"""Tests of copies of scenarios and of the files that they name."""

from collections.abc import Callable
from pathlib import Path

import pytest

from simscen.loading.files.copying import copy_scenario
from simscen.loading.reduction import with_inline_world
from simscen.loading.scenario import ChangedScenario, load_scenario

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


ROOM = "{{simscen: 1, name: {}, walls: [{{points: [[0, 0], [5, 0], [5, 5], [0, 5], [0, 0]]}}]}}\n"
BASE = "simscen: 1\nrobot: {pose: {x: 1, y: 1}}\npass: [{goals_reached: {}}]\n"


def test_paths_are_searched_beside_the_file_that_contains_them(write: Write, tmp_path: Path) -> None:
    write("bases/a.base.yaml", BASE)
    write("bases/room.world.yaml", ROOM.format("other"))
    write("scenarios/room.world.yaml", ROOM.format("own"))
    own = "extends: ../bases/a.base.yaml\nworld: room.world.yaml\ngoals: [{pose: {x: 4, y: 4}}]\n"
    loaded = load_scenario(write("scenarios/a.scenario.yaml", own), tmp_path)
    copy_scenario(loaded, tmp_path / "new" / "a.scenario.yaml", tmp_path / "new")
    assert load_scenario(tmp_path / "new" / "a.scenario.yaml", tmp_path / "new").world.name == "own"


def test_a_copy_keeps_place_names_and_comments(write: Write, tmp_path: Path) -> None:
    places = "{simscen: 1, places: {dock: {x: 4, y: 4}}, walls: [{points: [[0, 0], [5, 0], [5, 5], [0, 5], [0, 0]]}]}"
    criteria = "pass: [{eventually: {signal: distance_to, point: dock, op: <, value: 1 m}}]  # near the dock\n"
    text = BASE.replace("pass: [{goals_reached: {}}]\n", criteria) + f"goals: [dock]\nworld: {places}\n"
    loaded = load_scenario(write("a.scenario.yaml", text), tmp_path)
    copy_scenario(loaded, tmp_path / "b.scenario.yaml", tmp_path)
    assert (tmp_path / "b.scenario.yaml").read_text() == text


def test_a_changed_scenario_names_its_files_relative_to_its_new_folder(write: Write, tmp_path: Path) -> None:
    write("worlds/map.yaml", "image: room.pgm\nresolution: 0.5\norigin: [0, 0, 0]\n")
    (tmp_path / "worlds" / "room.pgm").write_bytes(b"P5 20 20 255\n" + b"\xfe" * 400)
    write("worlds/room.world.yaml", "{simscen: 1, name: room, map: map.yaml}\n")
    write("bases/a.base.yaml", f"{BASE}world: ./../worlds/room.world.yaml\n")
    text = "extends: ../bases/a.base.yaml  # a comment\ngoals: [{pose: {x: 4, y: 4}}]  # the goal\n"
    scenario = ChangedScenario(write("scenarios/a.scenario.yaml", text), tmp_path)
    loaded = scenario.load(scenario.tree)
    assert not isinstance(loaded, list)
    inline = with_inline_world(scenario.tree, loaded.world.tree)
    assert inline is not None
    folder = tmp_path / "results" / "today"
    for name, tree in (("kept", scenario.tree), ("inline", inline)):
        written = scenario.text_in(folder, tree, "Found.")
        assert written.startswith("# Found.\n")
        assert "# the goal" in written
        again = load_scenario(write(f"results/today/{name}.scenario.yaml", written), tmp_path)
        assert again.world.map is not None
        assert again.world.map.path == tmp_path / "worlds" / "map.yaml"


@pytest.mark.parametrize(
    ("original", "copy"),
    [
        ("&w it's.world.yaml  # hall", "&w 'b/it''s.world.yaml'  # hall"),
        ("'it''s.world.yaml'  # hall", "'b/it''s.world.yaml'  # hall"),
        ('"it\\u0027s.world.yaml"  # hall', '"b/it\'s.world.yaml"  # hall'),
        (">-\n  it's.world.yaml\n# hall", "'b/it''s.world.yaml'\n# hall"),
    ],
)
def test_the_text_around_a_path_is_kept_in_any_notation(write: Write, tmp_path: Path, original: str, copy: str) -> None:
    write("it's.world.yaml", ROOM.format("room"))
    start, end = f"{BASE}goals: [{{pose: {{x: 4, y: 4}}}}]\nworld: ", "\ndescription: text\n"
    loaded = load_scenario(write("a.scenario.yaml", start + original + end), tmp_path)
    copy_scenario(loaded, tmp_path / "new" / "b.scenario.yaml", tmp_path / "new")
    assert (tmp_path / "new" / "b.scenario.yaml").read_text() == start + copy + end
