"""Tests of shell completion."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from simscen.cli.commands.doctor import check_stacks
from simscen.cli.completions import scenarios

COMMAND = [sys.executable, "-c", "from simscen.cli.start import start; start()"]


def completions(*words: str) -> list[str]:
    """Return the completions of bash for these words, the last of which may be incomplete."""
    env = {**os.environ, "_SIMSCEN_COMPLETE": "complete_bash", "COMP_WORDS": " ".join(("simscen", *words)),
           "COMP_CWORD": str(len(words))}  # fmt: skip
    # The name of the variable, _SIMSCEN_COMPLETE, contains the name of the program.
    program = COMMAND[2].replace("start()", "import sys; sys.argv[0] = 'simscen'; start()", 1)
    result = subprocess.run([*COMMAND[:2], program], capture_output=True, text=True, env=env, check=False)
    assert result.stderr == ""
    return result.stdout.split()


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("exp",), ["explain"]),
        (("validate", "go"), ["good.scenario.yaml"]),
        (("explain", "amcl.update_min"), ["amcl.update_min_d", "amcl.update_min_a"]),
        (("explain", "stopped"), ["stopped_within"]),
        (("schema", "wo"), ["world"]),
        (("new", "mine", "--like", "navigation/go"), ["navigation/goal", "navigation/goal_occupied"]),
        (("run", "--stack", "refe"), ["reference"]),
        (("run", "--fail"), ["--fail-fast"]),
    ],
    ids=" ".join,
)
def test_completion_offers_commands_files_names_and_options(
    simscen, words: tuple[str, ...], offered: list[str]
) -> None:
    Path("deep").mkdir()
    assert set(offered) <= set(completions(*words))


def test_files_in_a_folder_are_completed_with_their_folder(simscen) -> None:
    Path("deep").mkdir()
    Path("good.scenario.yaml").rename("deep/one.scenario.yaml")
    assert completions("list", "de") == ["deep/"]
    assert completions("list", "deep/") == ["deep/one.scenario.yaml"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_script_of_each_shell_is_printed(simscen, shell: str) -> None:
    result = simscen("completion", shell)
    assert result.code == 0
    assert "_SIMSCEN_COMPLETE" in result.out


def test_bash_accepts_its_script(simscen) -> None:
    script = simscen("completion", "bash").out
    assert subprocess.run(["bash", "-n"], input=script, text=True, check=False).returncode == 0


@pytest.mark.parametrize("arguments", [("-h",), ("run", "-h"), ("world", "-h"), ("world", "convert", "-h")])
def test_help_has_a_short_option(simscen, arguments: tuple[str, ...]) -> None:
    result = simscen(*arguments)
    assert (result.code, "Usage:" in result.out) == (0, True)


def test_an_unknown_home_folder_is_no_error(simscen, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def no_home(_: Path) -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "expanduser", no_home)
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    assert simscen("list", "good.scenario.yaml").code == 0
    assert scenarios("~nobody/") == []
    assert "~/.config/simscen/config.yaml does not exist" in check_stacks()
