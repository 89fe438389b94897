"""Conformance tests of ROS maps with keys of other tools."""

import pytest

MAP = "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\ntype: indoor\nmoed: scale\n"
NOTES = """\
map.yaml:4:1: warning[SC311] `type` has no meaning in a ROS map
    4 | type: indoor
      | ^^^^
      = it is ignored, as by map_server
map.yaml:5:1: warning[SC311] `moed` has no meaning in a ROS map
    5 | moed: scale
      | ^^^^
      = did you mean `mode`?
"""


@pytest.fixture
def hall(folder):
    """Write the map of an empty hall of 6 m x 4 m; return the folder."""
    rows = [bytes(60), *[b"\0" + b"\xfe" * 58 + b"\0"] * 38, bytes(60)]
    (folder / "map.pgm").write_bytes(b"P5 60 40 255\n" + b"".join(rows))
    (folder / "map.yaml").write_text(MAP)
    return folder


@pytest.mark.parametrize("used", ["world: map.yaml", "world: room.world.yaml\nmap: map.yaml"])
@pytest.mark.parametrize("more", [(), ("--fast",)])
def test_keys_unknown_to_map_server_cause_a_warning(hall, simscen, used, more):
    text = (hall / "a.scenario.yaml").read_text()
    (hall / "a.scenario.yaml").write_text(text.replace("world: room.world.yaml", used))
    ended = simscen("validate", "a.scenario.yaml", *more)
    assert (ended.code, ended.out) == (0, NOTES + "1 scenario is valid\n")


def test_run_with_unknown_map_keys_succeeds(hall, simscen):
    text = (hall / "a.scenario.yaml").read_text()
    (hall / "a.scenario.yaml").write_text(text.replace("world: room.world.yaml", "world: map.yaml"))
    ended = simscen("run", "a.scenario.yaml", "--out", "out")
    assert (ended.code, ended.err) == (0, NOTES)


def test_validate_reads_a_map_and_its_image(hall, simscen):
    ended = simscen("validate", "map.yaml")
    assert (ended.code, ended.out) == (0, NOTES + "1 map is valid\n")
    (hall / "map.pgm").write_bytes(b"P5 60 40 255\n")
    ended = simscen("validate", "map.yaml")
    assert ended.code == 2
    assert "map.pgm: error[SC320] the PGM is truncated: 0 of 2400 pixels" in ended.out
