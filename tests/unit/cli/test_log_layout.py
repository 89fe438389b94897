"""`simscen log layout`."""

import json
from pathlib import Path


def test_default_layout_and_rviz_configuration_are_printed(simscen) -> None:
    ended = simscen("log", "layout")
    assert ended.code == 0
    assert "/simscen/things" in json.loads(ended.out)["configById"]["3D!scene"]["topics"]
    ended = simscen("log", "layout", "--rviz", "--out", "simscen.rviz")
    assert (ended.code, ended.out) == (0, "simscen.rviz\n")
    assert "Fixed Frame: map" in Path("simscen.rviz").read_text()


def test_invalid_arguments_of_layout_are_rejected(simscen) -> None:
    Path("no.mcap").write_text("nothing")
    ended = simscen("log", "layout", "no.mcap")
    assert ended.code == 2
    assert "SC801" in ended.err
    ended = simscen("log", "layout", "no.mcap", "--rviz")
    assert ended.code == 2
    assert "--rviz takes no log" in ended.err
    ended = simscen("log", "layout", "--out", "no.mcap/x.json")
    assert ended.code == 2
