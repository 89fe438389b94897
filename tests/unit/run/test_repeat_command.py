"""Tests of the printed command that repeats a run, and of the displayed paths."""

import shlex
from dataclasses import replace

from simscen.loading.scenario import load_scenario
from simscen.run.sessions.results import display_path, repeat_command

TEXT = "simscen: 1\nworld: {simscen: 1}\nrobot: {pose: {x: 0, y: 0}}\npass: [{collisions: {}}]\n"


def test_a_scenario_in_the_current_folder_needs_no_options(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a b.scenario.yaml").write_text(TEXT)
    scenario = load_scenario(tmp_path / "a b.scenario.yaml", tmp_path)
    assert repeat_command(scenario, 7) == "simscen run 'a b.scenario.yaml' --seed 7"


def test_command_contains_the_relative_path_and_all_options(tmp_path, monkeypatch):
    (tmp_path / "sub").mkdir()
    (tmp_path / "models").mkdir()
    (tmp_path / "sub/a.scenario.yaml").write_text(TEXT)
    monkeypatch.chdir(tmp_path / "models")
    scenario = load_scenario(tmp_path / "sub/a.scenario.yaml", tmp_path, [tmp_path / "models"])
    words = shlex.split(repeat_command(replace(scenario, lenient=True), 1))
    assert words[2:] == ["../sub/a.scenario.yaml", "--seed", "1", "--root", "..", "--world-path", ".", "--lenient"]


def test_displayed_path_is_absolute_if_that_is_shorter(tmp_path, monkeypatch):
    deep = tmp_path.joinpath(*"abcdefghijklmnopqrstuvwxyz")
    deep.mkdir(parents=True)
    monkeypatch.chdir(deep)
    (deep / "near").touch()
    assert display_path(deep / "near") == "near"
    assert display_path(tmp_path / "far") == str(tmp_path / "far") or len(str(tmp_path)) > 3 * 26
