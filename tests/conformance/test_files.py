"""Conformance tests of invalid files: `validate` and `run` report them with the same message."""

import os
import re
import socket
import tempfile
from pathlib import Path

import pytest

SCENARIO = "simscen: 1\nworld: {simscen: 1}\nrobot: {pose: {x: 0, y: 0}}\npass: [{goals_reached: {}}]\n"
LAUGHS = "\n".join(["a0: &a0 [x, x]", *(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12))])


def test_1_missing_path_is_an_error(refused) -> None:
    assert "nowhere.scenario.yaml: error[SC001] no such file or directory" in refused("nowhere.scenario.yaml")
    assert "nowhere: error[SC001] no such file or directory" in refused("nowhere")


@pytest.mark.parametrize("command", ["validate", "run"])
def test_2_a_folder_without_scenarios_is_not_a_success(simscen, folder: Path, command: str) -> None:
    (folder / "empty").mkdir()
    (folder / "empty/readme.yaml").write_text("x: 1")
    ended = simscen(command, "empty")
    assert (ended.code, ended.out) == (5, "")
    assert "no scenarios found in `empty`" in ended.err


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        pytest.param("", "", "the file is empty", id="3 empty"),
        pytest.param("# nothing\n\n# yet\n", "", "the file is empty", id="3 only comments"),
        pytest.param("- a\n- b\n", "1:1", "expected a mapping at top level, got a list", id="4 a list"),
        pytest.param("hello", "1:1", "expected a mapping at top level, got the text `hello`", id="4 a text"),
        pytest.param("simscen: 1\n---\nsimscen: 1\n", "2:1", "more than one YAML document (line 2)", id="5"),
        pytest.param("simscen: 1\nrobot:\n\tpose: start\n", "3:1", "tab character", id="6"),
        pytest.param("simscen: 1\ngoals: [a, b\npass: 1\n", "3:5", "", id="7 bracket"),
        pytest.param("simscen: 1\nname: 'a\n", "2:7", "this text in quotes is not closed", id="7 quote"),
        pytest.param("simscen: 1\nseed: 1\nseed: 2\n", "3:1", "duplicate key `seed` (first at 2:1)", id="8"),
        pytest.param("!!python/object/apply:os.system ['touch marker']\n", "1:1", "tag", id="23 python"),
        pytest.param("simscen: 1\nseed: !!int abc\n", "2:7", "tag", id="15 !!int abc"),
        pytest.param("simscen: 1\nname: !!timestamp 2001-99-99\n", "2:7", "tag", id="15 !!timestamp"),
        pytest.param("simscen: 1\nbase: &base [*base]\n", "2:14", "itself", id="24"),
        pytest.param("[" * 200_000, "1:41", "nested deeper than 40", id="21 brackets"),
        pytest.param("{a: " * 200_000, "1:161", "nested deeper than 40", id="21 braces"),
        pytest.param(LAUGHS, "6:25", "aliases expand to more than 100000 values", id="20"),
        pytest.param("simscen: 99\nwarp: 9\n", "1:10", "written for language version 99", id="30"),
        pytest.param("simscen: 1\nseed: " + "9" * 5000, "2:7", "integer too large", id="14"),
        pytest.param(b"simscen: 1\nname: caf\xe9\n", "2:10", "not valid UTF-8 at byte 20", id="16"),
        pytest.param("simscen: 1\n".encode("utf-16"), "1:1", "not valid UTF-8 at byte 0", id="17 UTF-16"),
        pytest.param("simscen: 1\n".encode("utf-16-le"), "1:2", "control character U+0000", id="17 no mark"),
        pytest.param(b"simscen: 1\nname: a\x00b\n", "2:8", "control character U+0000", id="18 NUL"),
        pytest.param(b"simscen: 1\nname: \x1b[31mred\n", "2:7", "control character U+001B", id="18 ESC"),
        pytest.param("simscen: 1\nname: a\u202eb\n", "2:8", "control character U+202E", id="18 bidirectional"),
    ],
)  # fmt: skip
def test_file_without_a_yaml_mapping_is_an_error(with_scenario, folder: Path, text, place: str, message: str) -> None:
    head = with_scenario(text).splitlines()[0]
    where = f"bad.scenario.yaml:{place}" if place else "bad.scenario.yaml"
    assert head.startswith(f"{where}: error[SC")
    assert message in head
    assert not (folder / "marker").exists()


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
    [
        pytest.param("time_limit", "tiem_limit", "6:1", "unknown key `tiem_limit`", id="9"),
        pytest.param("time_limit", "zzz", "6:1", "unknown key `zzz`", id="10"),
        pytest.param("seed: 7", 'seed: "7"', "2:7", "expected an integer, got the text `7`", id="11"),
        pytest.param("seed: 7", "seed: true", "2:7", "expected an integer, got the boolean true", id="12 integer"),
        pytest.param("x: 1,", "x: true,", "4:43", "expected a number, got the boolean true", id="12 number"),
        pytest.param("x: 1,", "x: .nan,", "4:43", "must be a finite number", id="13 nan"),
        pytest.param("x: 1,", "x: -.inf,", "4:43", "must be a finite number", id="13 inf"),
        pytest.param("x: 1,", "x: 1e400,", "4:43", "must be a finite number", id="13 1e400"),
        pytest.param("x: 1,", "x: 1e400 m,", "4:43", "must be a finite number", id="13 1e400 with a unit"),
        pytest.param("x: 1,", f"x: {'9' * 5000}.0 m,", "4:43", "must be a finite number", id="14 long with a unit"),
        pytest.param("seed: 7", "seed: 2001-99-99", "2:7", "expected an integer", id="15"),
        pytest.param("seed: 7", r'name: "\x1b[31m"', "2:7", "control character U+001B", id="19 ESC"),
        pytest.param("seed: 7", r'name: "a\0b"', "2:7", "control character U+0000", id="19 NUL"),
        pytest.param("seed: 7", r'name: "a\u202eb"', "2:7", "control character U+202E", id="19 bidirectional"),
        pytest.param("seed: 7", r'name: "a\nb"', "2:7", "control character U+000A", id="19 newline"),
        pytest.param("seed: 7", "seed: yes", "2:7", "expected an integer, got the text `yes`", id="25 yes"),
        pytest.param("seed: 7", "seed: 1:30", "2:7", "expected an integer, got the text `1:30`", id="25 1:30"),
        pytest.param("seed: 7", "seed: 012", "2:7", "expected an integer, got the text `012`", id="25 012"),
        pytest.param("time_limit: 20", "time_limit: 1:30", "6:13", "unknown unit `:30`", id="25 quantity"),
        pytest.param("time_limit: 20", "time_limit: 020", "6:13", "020", id="25 quantity with a zero"),
        pytest.param("seed: 7", "seed: 0", "2:7", "must be at least 1", id="89 seed 0"),
        pytest.param("seed: 7", f"name: {'x' * 121}", "2:7", "longer than 120 characters", id="limit of names"),
        pytest.param("x: 1,", "x: 10001,", "4:43", "must be at most 10000", id="limit of coordinates"),
        pytest.param("time_limit: 20", "time_limit: 8001", "6:13", "must be at most 8000", id="limit of steps"),
        pytest.param("seed: 7", "physics: {solver_iterations: 1001}", "2:30", "must be at most 1000", id="iterations"),
        pytest.param("seed: 7", "stack: {planner: {type: rrt_connect, max_iterations: 1000001}}", "2:54", "1000000",
                     id="limit of planning"),
        pytest.param("seed: 7", "stack: {localizer: {min_particles: 3000}}", "2:36",
                     "`min_particles` 3000 is greater than `max_particles` 2000", id="a minimum above its maximum"),
        pytest.param("seed: 7", "stack: {profile: [nav2]}", "2:18", "a list is not one of the choices",
                     id="a list of profiles"),
        pytest.param("seed: 7", "stack: {local_costmap: {obstacle_min_range: 3}}", "2:24",
                     "`obstacle_min_range` 3 is greater than `obstacle_max_range` 2.5", id="a minimum above a default"),
        pytest.param("seed: 7", "physics: {tick_rate: 1}", "2:22", "must be at least 60", id="limit of rates"),
        pytest.param("seed: 7", "stack: {localizer: {type: amcl, max_particles: 50001}}", "2:48", "50000",
                     id="limit of particles"),
    ],
)  # fmt: skip
def test_invalid_value_is_an_error(with_scenario, old: str, new: str, place: str, message: str) -> None:
    head = with_scenario(replace={old: new}).splitlines()[0]
    assert head.startswith(f"bad.scenario.yaml:{place}: error[SC")
    assert message in head


def test_9_and_10_unknown_key_gets_a_suggestion_or_the_valid_keys(with_scenario) -> None:
    assert "= did you mean `time_limit`?" in with_scenario(replace={"time_limit": "tiem_limit"})
    assert "expected one of: simscen, name, description, tags, seed" in with_scenario(replace={"time_limit": "zzz"})


def test_20_alias_bomb_is_refused_and_ordinary_aliases_work(peak_memory, simscen, folder: Path) -> None:
    (folder / "bomb.scenario.yaml").write_text(LAUGHS)
    code, peak, message = peak_memory("validate", "bomb.scenario.yaml")
    assert code == 2
    assert "aliases" in message
    assert peak < 100
    good = (folder / "a.scenario.yaml").read_text()
    good = good.replace("pose: {x: 1, y: 1}", "pose: &start {x: 1, y: 1}").replace(
        "pose: {x: 1.5, y: 1}", "pose: *start"
    )
    (folder / "a.scenario.yaml").write_text(good)
    assert simscen("validate", "a.scenario.yaml").code == 0


def test_22_file_of_100_mb_is_refused(peak_memory, refused, folder: Path) -> None:
    with (folder / "huge.scenario.yaml").open("wb") as file:
        file.truncate(100 << 20)
    assert "huge.scenario.yaml: error[SC001] larger than 1 MiB" in refused("huge.scenario.yaml")
    _, peak, _ = peak_memory("validate", "huge.scenario.yaml")
    assert peak < 100


def create_special_file(folder: Path, kind: str, name: str) -> None:
    """Create a folder, FIFO, link to a device, or socket called `name`."""
    if kind == "folder":
        (folder / name).mkdir()
    elif kind == "fifo":
        os.mkfifo(folder / name)
    elif kind == "device":
        (folder / name).symlink_to("/dev/zero")
    else:
        with socket.socket(socket.AF_UNIX) as end:
            end.bind(name)


SPECIAL_KINDS = ["folder", "fifo", "device", "socket"]


@pytest.mark.parametrize("kind", SPECIAL_KINDS[1:])
def test_26_only_regular_files_are_read(refused, folder: Path, kind: str) -> None:
    create_special_file(folder, kind, "special.scenario.yaml")
    message = refused("special.scenario.yaml")
    assert re.match(r"special.scenario.yaml: error\[SC0(01|20)\] (not a regular file|the file is outside)", message)


def test_26_a_folder_with_the_name_of_a_scenario_is_an_error_with_its_name(simscen, folder: Path) -> None:
    (folder / "special.scenario.yaml").mkdir()
    ended = simscen("validate", "special.scenario.yaml")
    assert ended.code == 2
    assert "special.scenario.yaml: error[SC001] is a folder" in ended.err
    assert simscen("validate", ".").code == 0


@pytest.mark.parametrize("kind", SPECIAL_KINDS[1:])
def test_26_search_reads_only_regular_files(refused, folder: Path, kind: str) -> None:
    create_special_file(folder, kind, "special.scenario.yaml")
    assert "special.scenario.yaml: error[SC0" in refused(".")


@pytest.mark.parametrize("kind", SPECIAL_KINDS)
@pytest.mark.parametrize(
    ("old", "place"), [("room.world.yaml", "3:8"), ("cube.robot.yaml", "4:16")], ids=["world", "robot"]
)
def test_26_world_and_robot_must_be_regular_files(with_scenario, folder: Path, kind: str, old: str, place: str) -> None:
    create_special_file(folder, kind, "special.yaml")
    message = with_scenario(replace={old: "special.yaml"})
    expected = "outside the scenario root" if kind == "device" else "not a regular file"
    assert message.startswith(f"bad.scenario.yaml:{place}: error[SC0")
    assert expected in message


@pytest.mark.parametrize("kind", SPECIAL_KINDS)
def test_26_defaults_and_bases_must_be_regular_files(with_scenario, folder: Path, kind: str) -> None:
    create_special_file(folder, kind, "special.yaml")
    assert "special.yaml" in with_scenario("extends: special.yaml\n")
    (folder / "special.yaml").rename(folder / "defaults.yaml")
    assert "defaults.yaml: error[SC0" in with_scenario(replace={})


@pytest.fixture
def unprivileged_folder(refused, simscen):
    """Change into a folder with mode 777, as an unprivileged user even if the tests run as root."""
    before = Path.cwd()
    # Import everything before: Python may be installed where only root can read.
    simscen("validate", ".")
    refused("nowhere.scenario.yaml")
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o777)
        os.chdir(name)
        root = os.geteuid() == 0
        if root:
            os.seteuid(65534)
        try:
            yield Path(name)
        finally:
            if root:
                os.seteuid(0)
            os.chdir(before)


def test_27_unreadable_file_is_an_error(refused, unprivileged_folder: Path) -> None:
    (unprivileged_folder / "locked.scenario.yaml").write_text("simscen: 1")
    (unprivileged_folder / "locked.scenario.yaml").chmod(0)
    assert refused("locked.scenario.yaml") == "locked.scenario.yaml: error[SC001] permission denied\n"


def test_27_unsearchable_folder_is_an_error(refused, unprivileged_folder: Path) -> None:
    (unprivileged_folder / "locked").mkdir(mode=0)
    message = refused("locked/a.scenario.yaml")
    assert message == "locked/a.scenario.yaml: error[SC001] permission denied\n"


def test_27_unsearchable_subfolder_is_an_error(refused, unprivileged_folder: Path) -> None:
    (unprivileged_folder / "a.scenario.yaml").write_text(SCENARIO)
    (unprivileged_folder / "locked").mkdir(mode=0)
    assert refused(".") == "./locked: error[SC001] permission denied\n"


def test_28_all_mistakes_are_reported_up_to_a_limit(with_scenario) -> None:
    few = with_scenario("simscen: 1\n" + "".join(f"k{i}: 1\n" for i in range(22)))
    assert all(f"bad.scenario.yaml:{line}:1: error[SC012]" in few for line in range(2, 24))
    many = with_scenario("simscen: 1\n" + "".join(f"k{i}: 1\n" for i in range(80)))
    assert many.count("error[") == 50
    assert "bad.scenario.yaml: … and 33 more\n" in many


def test_29_one_invalid_file_prevents_all_runs(refused, folder: Path) -> None:
    good = (folder / "a.scenario.yaml").read_text()
    for name in "bcde":
        (folder / f"{name}.scenario.yaml").write_text(good.replace("seed: 7", "seed: x") if name in "bd" else good)
    message = refused(".")
    assert [line.split(":")[0] for line in message.splitlines() if "error[" in line] == [
        "b.scenario.yaml", "d.scenario.yaml"
    ]  # fmt: skip


def test_search_does_not_follow_link_cycles(simscen, folder: Path) -> None:
    (folder / "sub").mkdir()
    (folder / "sub/up").symlink_to("..")
    assert simscen("validate", ".").code == 0
