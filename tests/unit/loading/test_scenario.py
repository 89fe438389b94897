"""Tests of loading scenarios with their worlds, robots, maps, and plug-ins."""

from collections.abc import Callable
from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput
from simscen.loading.files.paths import scenario_id
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of
from simscen.loading.scenario import load_scenario
from tests.scenario_files import try_scenario

Write = Callable[[str, str], Path]
MAP = "image: floor.pgm\nresolution: 5 cm\norigin: [0, 0, 0.5]\n"


def _loaded(path: Path, root: Path, *world_path: Path) -> LoadedScenario:
    loaded = try_scenario(path, root, world_path)
    assert isinstance(loaded, LoadedScenario), loaded
    return loaded


def test_a_scenario_comes_with_its_world_and_robot(write: Write, scenario: str, tmp_path: Path) -> None:
    loaded = _loaded(
        write("faults/drive.scenario.yaml", scenario.replace(": room", ": ../room").replace(": cube", ": ../cube")),
        tmp_path,
    )
    assert (loaded.id, loaded.path) == ("faults/drive", "faults/drive.scenario.yaml")
    assert loaded.world.spec is not None
    assert list(loaded.world.spec.places) == ["start", "desk"]
    assert (loaded.world.path, loaded.world.name) == (tmp_path / "room.world.yaml", "room")
    assert loaded.robot.spec is not None
    assert loaded.robot.spec.drive.wheel_radius == 0.05  # type: ignore[union-attr]
    assert loaded.map is None
    assert loaded.text == loaded.file.read_text()


def test_places_of_values_and_keys_are_known(write: Write, scenario: str, tmp_path: Path) -> None:
    loaded = _loaded(write("a.scenario.yaml", scenario), tmp_path)
    assert loaded.position_of("goals", 0, "pose") == ("a.scenario.yaml", 4, 16)
    assert loaded.key_position_of("goals", 0, "pose") == ("a.scenario.yaml", 4, 10)
    problem = loaded.problem(("goals", 0, "pose"), "SC301", "in a wall")
    assert (problem.place, problem.source) == ("a.scenario.yaml:4:16", "goals: [{pose: desk}]")


@pytest.mark.parametrize("version", ["", "simscen: 1, "])
def test_inline_world_belongs_to_the_scenario(write: Write, scenario: str, tmp_path: Path, version: str) -> None:
    places = "places: {start: {x: 0, y: 0}, desk: {x: 1, y: 1}}"
    inline = scenario.replace("room.world.yaml", f"{{{version}{places}}}")
    loaded = _loaded(write("a.scenario.yaml", inline), tmp_path)
    assert loaded.world.path == loaded.file
    assert loaded.world.spec is loaded.spec.world


def test_a_ros_map_can_be_world_and_map(write: Write, scenario: str, tmp_path: Path) -> None:
    write("map.yaml", MAP)
    image = write("floor.pgm", "P2 1 1 255 0")
    text = (
        scenario.replace("room.world.yaml", "map.yaml\nmap: map.yaml")
        .replace("start", "{x: 1, y: 1}")
        .replace("desk", "{x: 2, y: 1}")
    )
    loaded = _loaded(write("a.scenario.yaml", text), tmp_path)
    assert loaded.world.map is not None
    assert loaded.world.map.image == image
    assert loaded.world.spec is None
    assert loaded.map == loaded.world.map


def test_world_can_be_based_on_a_ros_map(write: Write, scenario: str, tmp_path: Path) -> None:
    write("maps/map.yaml", MAP)
    write("maps/floor.pgm", "P2 1 1 255 0")
    write("room.world.yaml", "simscen: 1\nmap: maps/map.yaml\nplaces: {start: {x: 0, y: 0}, desk: {x: 1, y: 1}}")
    loaded = _loaded(write("a.scenario.yaml", scenario), tmp_path)
    assert loaded.world.map is not None
    assert loaded.world.map.path == tmp_path / "maps/map.yaml"


def test_map_none_means_no_map(write: Write, scenario: str, tmp_path: Path) -> None:
    assert _loaded(write("a.scenario.yaml", scenario + "map: none\n"), tmp_path).map == "none"


def test_gazebo_worlds_and_urdfs_are_known_by_their_suffix(write: Write, scenario: str, tmp_path: Path) -> None:
    write("sim/hall.world", "<sdf/>")
    write("sim/bot.urdf", "<robot/>")
    text = scenario.replace("room.world.yaml", "sim/hall.world").replace("cube.robot.yaml", "sim/bot.urdf")
    text = text.replace("start", "{x: 1, y: 1}").replace("desk", "{x: 2, y: 1}")
    loaded = _loaded(write("a.scenario.yaml", text), tmp_path)
    assert (loaded.world.sdf, loaded.robot.urdf) == (tmp_path / "sim/hall.world", tmp_path / "sim/bot.urdf")
    assert (loaded.world.spec, loaded.robot.spec) == (None, None)
    assert plugins_of(loaded) == ()


def test_a_shipped_robot_is_known_by_its_name(write: Write, scenario: str, tmp_path: Path) -> None:
    loaded = _loaded(write("a.scenario.yaml", scenario.replace("cube.robot.yaml", "turtlebot")), tmp_path)
    assert loaded.robot.spec is not None


def test_worlds_elsewhere_are_found_where_the_command_line_allows(write: Write, scenario: str, tmp_path: Path) -> None:
    text = scenario.replace("room.world.yaml", "model://room.world.yaml").replace("cube.robot.yaml", "cube.robot.yaml")
    path = write("project/a.scenario.yaml", text)
    write("project/cube.robot.yaml", (tmp_path / "cube.robot.yaml").read_text())
    assert isinstance(try_scenario(path, tmp_path / "project"), list)
    assert _loaded(path, tmp_path / "project", tmp_path).world.path == tmp_path / "room.world.yaml"


def test_paths_are_relative_to_the_file_they_are_written_in(write: Write, scenario: str, tmp_path: Path) -> None:
    write("base/base.yaml", scenario.replace(": room", ": ../room").replace(": cube", ": ../cube"))
    loaded = _loaded(write("deep/er/a.scenario.yaml", "extends: ../../base/base.yaml\nseed: 3\n"), tmp_path)
    assert loaded.spec.seed == 3
    assert loaded.position_of("world").path == "base/base.yaml"
    assert set(loaded.sources) >= {"base/base.yaml", "deep/er/a.scenario.yaml"}


def test_a_scenario_out_of_the_root_is_refused(write: Write, scenario: str, tmp_path: Path) -> None:
    path = write("a.scenario.yaml", scenario)
    (tmp_path / "root").mkdir()
    link = tmp_path / "root/b.scenario.yaml"
    link.symlink_to(path)
    for file in (path, link):
        problems = try_scenario(file, tmp_path / "root")
        assert isinstance(problems, list)
        assert [p.code for p in problems] == ["SC020"]


def test_every_problem_is_raised_at_once(write: Write, scenario: str, tmp_path: Path) -> None:
    path = write("a.scenario.yaml", scenario.replace("goals:", "gaols:") + "seed: no\n")
    with pytest.raises(InvalidInput) as raised:
        load_scenario(path, tmp_path)
    assert [(p.line, p.code) for p in raised.value.problems] == [(4, "SC012"), (6, "SC011")]
    assert "a.scenario.yaml:4:1: unknown key `gaols`" in str(raised.value)


def test_problems_of_scenario_and_world_are_reported_together(write: Write, scenario: str, tmp_path: Path) -> None:
    write("room.world.yaml", "simscen: 1\nwals: []")
    problems = try_scenario(write("a.scenario.yaml", scenario + "sed: 1"), tmp_path)
    assert isinstance(problems, list)
    assert {p.path for p in problems} == {"a.scenario.yaml", "room.world.yaml"}


def test_ids_have_no_suffix(tmp_path: Path) -> None:
    for name in ("a/b.scenario.yaml", "a/b.scenario.yml", "a/b.yaml", "a/b"):
        assert scenario_id(tmp_path / name, tmp_path) == "a/b"


@pytest.mark.parametrize("path", ["m.yaml", "./m.yaml"])
def test_one_path_cannot_name_the_masks_of_two_files(write: Write, scenario: str, tmp_path: Path, path: str) -> None:
    """The item of `pass+` is next to another mask than the criterion of the base file, which has the path `m.yaml`."""
    for folder in ("", "bases/"):
        write(f"{folder}m.pgm", "P2 1 1 255 255")
        write(f"{folder}m.yaml", "{image: m.pgm, resolution: 1, origin: [0, 0, 0]}")
    write("bases/aisle.base.yaml", "pass: [{keepout: {mask: m.yaml}}]")
    text = scenario.replace("pass:", "extends: bases/aisle.base.yaml\npass+:")
    file = write("a.scenario.yaml", text.replace("{}}]", f"{{}}}}, {{keepout: {{mask: {path}}}}}]"))
    found = try_scenario(file, tmp_path)
    assert isinstance(found, list) is (path == "m.yaml")
    if isinstance(found, list):
        assert [(problem.path, problem.line, problem.code) for problem in found] == [("a.scenario.yaml", 6, "SC016")]
    else:
        assert {name: mask.map.path for name, mask in found.criterion_masks.items()} == {
            "m.yaml": tmp_path / "bases" / "m.yaml",
            "./m.yaml": tmp_path / "m.yaml",
        }
