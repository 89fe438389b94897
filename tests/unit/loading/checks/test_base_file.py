"""Tests of the validation of base files."""

import pytest

from simscen.loading.checks.files import check_file, file_kind

BASE = """\
simscen: 1
world: room.world.yaml
robot: {model: cube.robot.yaml}
stack: {controller: {desired_linear_vel: 0.3}}
"""


def problems_of(write, text: str, name: str = "a.base.yaml") -> list[str]:
    file = write(name, text)
    assert file_kind(file, file.parent) == "base"
    return [f"{found.line}:{found.col} {found.message}" for found in check_file("base", file, file.parent)]


@pytest.mark.parametrize("name", ["a.base.yaml", "a.base.yml", "defaults.yaml", "deep/defaults.yaml"])
def test_base_can_omit_required_keys(write, name: str) -> None:
    assert problems_of(write, "tags: [smoke]\n", name) == []


def test_a_base_may_say_a_part_of_a_mapping(write) -> None:
    assert problems_of(write, BASE) == []


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (BASE + "gaols: []\n", "5:1 unknown key `gaols`"),
        (BASE.replace("0.3", "fast"), "4:42 expected a speed, got the text `fast`"),
        (BASE.replace("room.world", "rom.world"), "2:8 no such file or directory"),
        (BASE.replace("cube.", "cub."), "3:16 no such file or directory"),
        (BASE + "goals: [{timeout: 3 s}]\n", "5:9 missing key `pose` in `goals[0]`"),
        (BASE + "pass:\n", "5:1 `pass` has no value"),
        (BASE + "pass: [{collisions: {}}]\npass+: [{collisions: {}}]\n", "6:1 unknown key `pass+`"),
        ("simscen: 2\n", "1:10 written for language version 2"),
        ("- a\n", "1:1 expected a mapping at top level"),
        ("extends: b.base.yaml\n", "1:10 no such file or directory"),
        ("map: no.yaml\n", "1:6 no such file or directory"),
        ("stack: {nav2_params: no.yaml}\n", "1:22 no such file or directory"),
        ("stack: {keepout_mask: no.yaml}\n", "1:23 no such file or directory"),
        ("stack: {speed_mask: {file: no.yaml}}\n", "1:28 no such file or directory"),
        ("pass: [{keepout: {mask: no.yaml}}]\n", "1:25 no such file or directory"),
        ("pass+: [{speed: {mask: {file: no.yaml}}}]\n", "1:31 no such file or directory"),
        ("robots: {a: {model: no.robot.yaml}, b: {}}\n", "1:21 no such file or directory"),
        ("robots: {a: {}, b: {stack: {nav2_params: no.yaml}}}\n", "1:42 no such file or directory"),
    ],
)
def test_content_of_a_base_is_checked(write, text: str, problem: str) -> None:
    found = problems_of(write, text)
    assert [message for message in found if problem in message], found


def test_list_additions_of_a_base_are_checked(write) -> None:
    assert problems_of(write, "pass+: [{collisions: {max: 0}}]\n") == []
    assert problems_of(write, "pass+: [{colisions: {max: 0}}]\n")[0].startswith("1:10 unknown key `colisions`")


def test_a_base_may_extend_another(write) -> None:
    write("b.base.yaml", "linger: 1\n")
    assert problems_of(write, "extends: b.base.yaml\n") == []
    write("b.base.yaml", "linger: no\n")
    assert problems_of(write, "extends: b.base.yaml\n") == ["1:9 expected a duration, got the text `no`"]
