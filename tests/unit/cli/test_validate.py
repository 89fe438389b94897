"""Tests of `simscen validate`."""

import json
from pathlib import Path

import pytest
import yaml
from PIL import Image

BAD = "simscen: 1\nwrold: x\nrobot: {pose: {x: 1, y: 2 s}}\npass: [{goals_reached: {}}]\n"


def test_valid_files_are_counted_by_kind(simscen, tmp_path: Path) -> None:
    (tmp_path / "a.world.yaml").write_text("simscen: 1\n")
    result = simscen("validate", ".")
    assert result == (0, "1 world and 1 scenario are valid\n", "")


def test_every_problem_is_shown_with_its_line(simscen, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/bad.scenario.yaml").write_text(BAD)
    result = simscen("validate", ".")
    assert result.code == 2
    assert result.out == (
        "sub/bad.scenario.yaml:2:1: error[SC012] unknown key `wrold`\n"
        "    2 | wrold: x\n"
        "      | ^^^^^\n"
        "      = did you mean `world`?\n"
        "sub/bad.scenario.yaml:3:25: error[SC015] `s` is a unit of duration, but this is a length\n"
        "    3 | robot: {pose: {x: 1, y: 2 s}}\n"
        "      |                         ^^^\n"
        "      = units: m, cm, mm, km; a number without a unit is in SI units\n"
        "2 problems in 1 of 2 files\n"
    )


def test_json_is_printed(simscen, tmp_path: Path) -> None:
    (tmp_path / "bad.scenario.yaml").write_text(BAD)
    result = simscen("validate", ".", "--format", "json")
    output = json.loads(result.out)
    assert (result.code, output["valid"], output["files"]) == (2, False, 2)
    assert output["problems"][0] == {
        "path": "bad.scenario.yaml", "line": 2, "col": 1, "code": "SC012", "severity": "error",
        "message": "unknown key `wrold`", "hint": "did you mean `world`?",
    }  # fmt: skip


def test_github_annotations_are_printed(simscen, tmp_path: Path) -> None:
    (tmp_path / "bad.scenario.yaml").write_text(BAD)
    first = simscen("validate", ".", "--format", "github").out.splitlines()[0]
    assert first == (
        "::error file=bad.scenario.yaml,line=2,col=1,title=simscen SC012::unknown key `wrold`%0Adid you mean `world`?"
    )


def test_missing_file_is_printed_in_the_chosen_format(simscen) -> None:
    result = simscen("validate", "missing.yaml", "--format", "json")
    output = json.loads(result.out)
    assert (result.code, output["valid"], output["files"]) == (2, False, 0)
    assert [(problem["path"], problem["code"]) for problem in output["problems"]] == [("missing.yaml", "SC001")]
    result = simscen("validate", "missing.yaml", "--format", "github")
    assert (result.code, result.out[:25]) == (2, "::error file=missing.yaml")


def test_goal_in_a_wall_is_found_without_a_run(simscen, tmp_path: Path) -> None:
    scenario = (tmp_path / "good.scenario.yaml").read_text()
    (tmp_path / "bad.scenario.yaml").write_text(scenario.replace("x: 5, y: 3", "x: 3, y: 2"))
    result = simscen("validate", "bad.scenario.yaml")
    assert result.code == 2
    assert 'is inside obstacle "crate"' in result.out


@pytest.mark.parametrize(
    ("argument", "code", "expected_text"),
    [
        ("nowhere", 2, "nowhere: error[SC001] no such file or directory"),
        ("x" * 5000, 2, "the name is too long"),
        ("empty", 5, "no scenarios found in `empty`"),
    ],
)
def test_invalid_arguments_are_errors(simscen, tmp_path: Path, argument: str, code: int, expected_text: str) -> None:
    (tmp_path / "empty").mkdir()
    result = simscen("validate", argument)
    assert result.code == code
    assert expected_text in result.err
    assert "Traceback" not in result.err


@pytest.mark.parametrize("name", ["[/red]", "::error::x", "##[error]x", "]]><script>", "a\nb"])
def test_control_sequences_in_file_names_are_escaped(simscen, tmp_path: Path, name: str) -> None:
    file = tmp_path / f"{name.replace('/', '-')}.scenario.yaml"
    file.write_text("simscen: 1\n::set-output name=x:: 1\n")
    for kind in ("text", "github"):
        out = simscen("validate", file.name, "--format", kind).out
        commands = [line for line in out.splitlines() if line.lstrip().startswith("::")]
        assert all(line.startswith("::error file=") for line in commands)
        assert "##[" not in out


def test_number_of_printed_problems_is_limited(simscen, tmp_path: Path) -> None:
    keys = "".join(f"k{i}: 1\n" for i in range(80))
    (tmp_path / "bad.scenario.yaml").write_text("simscen: 1\n" + keys)
    result = simscen("validate", "bad.scenario.yaml")
    assert "bad.scenario.yaml: … and 33 more" in result.out
    assert result.out.endswith("83 problems in 1 of 1 file\n")


SEALED = "{points: [[4, 0], [4, 4]], name: partition}, "


def test_geometric_problems_are_drawn_on_request(simscen, tmp_path: Path) -> None:
    scenario = (tmp_path / "good.scenario.yaml").read_text()
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/bad.scenario.yaml").write_text(scenario.replace("walls: [", f"walls: [{SEALED}"))
    result = simscen("validate", ".", "--picture", "pictures")
    assert (result.code, result.out.count("picture: pictures/sub/bad.png")) == (2, 1)
    assert [path.name for path in (tmp_path / "pictures").rglob("*.png")] == ["bad.png"]


def test_picture_does_not_overwrite_the_map_of_the_world(simscen, tmp_path: Path) -> None:
    Image.new("L", (100, 100), 255).save(tmp_path / "hall.png")
    origin = "origin: [-1, -1, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    (tmp_path / "hall.yaml").write_text(f"image: hall.png\nresolution: 0.1\n{origin}")
    text = (tmp_path / "good.scenario.yaml").read_text()
    world = yaml.safe_dump({**yaml.safe_load(text), "world": "hall.yaml", "robot": {"pose": {"x": 20, "y": 1}}})
    (tmp_path / "hall.scenario.yaml").write_text(world)
    original = (tmp_path / "hall.png").read_bytes()
    result = simscen("validate", "hall.scenario.yaml", "--picture", ".")
    assert (result.code, "cannot write the picture hall.png: it is one of the input files" in result.err) == (2, True)
    assert (tmp_path / "hall.png").read_bytes() == original


def test_unwritable_picture_is_an_error(simscen, tmp_path: Path) -> None:
    scenario = (tmp_path / "good.scenario.yaml").read_text()
    (tmp_path / "bad.scenario.yaml").write_text(scenario.replace("walls: [", f"walls: [{SEALED}"))
    (tmp_path / "file").write_text("")
    result = simscen("validate", "bad.scenario.yaml", "--picture", "file")
    assert (result.code, "cannot write the picture file/bad.png" in result.err) == (2, True)


def test_fast_skips_only_geometric_checks(simscen, tmp_path: Path) -> None:
    scenario = (tmp_path / "good.scenario.yaml").read_text()
    (tmp_path / "sealed.scenario.yaml").write_text(scenario.replace("walls: [", f"walls: [{SEALED}"))
    assert simscen("validate", "sealed.scenario.yaml").code == 2
    assert simscen("validate", "sealed.scenario.yaml", "--fast").code == 0
    (tmp_path / "late.scenario.yaml").write_text(
        f"{scenario}time_limit: 9 s\nevents: [{{when: {{time: 9 s}}, do: {{cancel_goal: {{}}}}}}]\n"
    )
    assert "can never happen" in simscen("validate", "late.scenario.yaml", "--fast").out


def test_base_file_is_counted_and_checked(simscen, tmp_path: Path) -> None:
    (tmp_path / "aisle.base.yaml").write_text("robot: {model: amr}\npass: [{collisions: {max: 0}}]\n")
    (tmp_path / "defaults.yaml").write_text("tags: [smoke]\n")
    assert simscen("validate", "aisle.base.yaml", "defaults.yaml") == (0, "2 bases are valid\n", "")
    assert simscen("validate", ".") == (0, "1 base and 1 scenario are valid\n", "")
    (tmp_path / "defaults.yaml").write_text("tag: [smoke]\n")
    result = simscen("validate", "defaults.yaml")
    assert result.code == 2
    assert "defaults.yaml:1:1: error[SC012] unknown key `tag`" in result.out


DOCK = """\
simscen: 1
walls: [{points: [[0, 0], [8, 0], [8, 4], [0, 4], [0, 0]]}]
obstacles: [{name: dock, box: [2, 2, 0.12], pose: {x: 1, y: 2}}, {name: shelf, box: [1, 1, 1], pose: {x: 6, y: 2}}]
RAMP
places: {up: {x: 1, y: 2}, shelf: {x: 6, y: 2}}
"""


@pytest.mark.parametrize(
    ("ramps", "places_inside"),
    [("ramps: [{name: ramp, start: [3.5, 2], end: [2, 2], width: 2, height: 12 cm}]", ["shelf"]),
     ("ramps: []", ["up", "shelf"])],
    ids=["with ramp", "without ramp"],
)  # fmt: skip
def test_place_can_be_on_a_platform_behind_a_ramp(
    simscen, tmp_path: Path, ramps: str, places_inside: list[str]
) -> None:
    (tmp_path / "dock.world.yaml").write_text(DOCK.replace("RAMP", ramps))
    result = simscen("validate", "dock.world.yaml")
    assert [name for name in ("up", "shelf") if f"place `{name}` is inside obstacle" in result.out] == places_inside
