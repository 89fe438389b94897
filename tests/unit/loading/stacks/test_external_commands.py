"""Tests of the commands of external stacks."""

import os
from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput
from simscen.loading.stacks.external_commands import parse_command
from simscen.loading.stacks.userconfig import load_config


@pytest.mark.parametrize("arguments", [("-c", "x" * 300), ("-m", "x" * 300), ("-c", "x" * 300 + ".py")])
def test_arguments_that_are_too_long_for_a_path_are_no_files(tmp_path: Path, arguments: tuple[str, str]) -> None:
    command = parse_command(" ".join(("python3", *arguments)), os.environ, tmp_path)
    assert command.argv[1:] == arguments


def test_the_home_folder_of_an_unknown_user_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no such file or directory"):
        parse_command("~nobody-has-this-name/stack", os.environ, tmp_path)
    (tmp_path / "config.yaml").write_text("simscen: 1\nstacks: {a: {command: cat, cwd: ~nobody-has-this-name}}\n")
    with pytest.raises(InvalidInput, match="no such folder"):
        load_config(tmp_path / "config.yaml").command("a", os.environ, tmp_path)
