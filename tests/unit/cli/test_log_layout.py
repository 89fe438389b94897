"""Tests of `simscen log layout`."""

import json
from pathlib import Path


def test_default_layout_and_rviz_configuration_are_printed(simscen) -> None:
    result = simscen("log", "layout")
    assert result.code == 0
    assert "/simscen/things" in json.loads(result.out)["configById"]["3D!scene"]["topics"]
    result = simscen("log", "layout", "--rviz", "--out", "simscen.rviz")
    assert (result.code, result.out) == (0, "simscen.rviz\n")
    assert "Fixed Frame: map" in Path("simscen.rviz").read_text()


def test_invalid_arguments_of_layout_are_rejected(simscen) -> None:
    Path("no.mcap").write_text("nothing")
    result = simscen("log", "layout", "no.mcap")
    assert result.code == 2
    assert "SC801" in result.err
    result = simscen("log", "layout", "no.mcap", "--rviz")
    assert result.code == 2
    assert "--rviz takes no log" in result.err
    result = simscen("log", "layout", "--out", "no.mcap/x.json")
    assert result.code == 2
