"""Tests of the main function: help, errors with their exit codes, and imports of commands."""

import signal
import subprocess
import sys

import pytest

import simscen.cli.main as cli
from simscen.core.errors import NothingSelected, UsageError
from simscen.run.process.supervisor import Interrupted


def test_help_lists_the_commands_without_importing_them(simscen) -> None:
    result = simscen("--help")
    assert result.code == 0
    assert "validate Check scenario, world, robot, and stack files without running anything." in " ".join(
        result.out.split()
    )


def test_call_without_a_command_prints_the_help(simscen) -> None:
    result = simscen()
    assert "Commands:" in result.out + result.err


def test_version_is_printed(simscen) -> None:
    assert simscen("--version").out.startswith("simscen 0")


@pytest.mark.parametrize(
    "name", [name for name in cli.COMMANDS if cli.importlib.util.find_spec(f"simscen.cli.commands.{name}")]
)
def test_command_table_matches_the_help(simscen, name: str) -> None:
    output = " ".join(simscen(name, "--help").out.split())
    assert cli.COMMANDS[name].rstrip(".") in output


def test_unknown_command_is_a_usage_error(simscen) -> None:
    result = simscen("rum")
    assert result.code == 2
    assert "No such command 'rum'" in result.err


@pytest.mark.parametrize(
    ("error", "code", "expected_text"),
    [
        (UsageError("no such folder"), 2, "simscen: no such folder\n"),
        (NothingSelected("nothing matches"), 5, "simscen: nothing matches\n"),
        (UsageError("::error::[/red]\nx"), 2, "simscen: :\\:error::[/red] x\n"),
        (KeyboardInterrupt(), 130, ""),
        (Interrupted(signal.SIGTERM), 143, ""),  # a signal after the last run, but before the reports
    ],
)
def test_errors_become_messages_and_exit_codes(
    simscen, monkeypatch, error: BaseException, code: int, expected_text: str
) -> None:
    def broken() -> None:
        raise error

    monkeypatch.setattr(cli, "app", broken)
    assert simscen()[0::2] == (code, expected_text)


LONG = "a" * 300


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "good.scenario.yaml", "--stack", f"x={LONG}.yaml"),
        ("run", "good.scenario.yaml", "--out", LONG),
        ("shrink", LONG),
        ("edit", LONG),
        ("report", LONG),
        ("compare", LONG, LONG),
    ],
)
def test_a_path_that_cannot_be_accessed_is_a_usage_error(simscen, arguments: tuple[str, ...]) -> None:
    result = simscen(*arguments)
    assert result.code == 2
    assert "File name too long" in result.err and "Traceback" not in result.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("robot", "check", LONG), "expected one of: amr, car,"),
        (("world", "inspect", f"{LONG}.sdf"), "error[SC001] no such file or directory"),
    ],
)
def test_a_file_whose_name_is_too_long_does_not_exist(simscen, arguments: tuple[str, ...], message: str) -> None:
    result = simscen(*arguments)
    assert result.code == 2
    assert message in result.err


def test_unexpected_exception_is_an_internal_error(simscen, monkeypatch) -> None:
    def broken() -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(cli, "app", broken)
    result = simscen()
    assert result.code == 4
    assert "internal error" in result.err


IMPORT_CHECK = """
import sys
from simscen.cli.main import main
sys.argv = ["simscen", *{arguments}]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
heavy = {{"pybullet", "ompl", "scipy", "filterpy", "trimesh", "embreex", "PIL", "mcap", "rich"}} & set(sys.modules)
if sys.argv[1] != "validate":  # the geometry of a valid scenario is checked with numpy
    heavy |= {{"numpy.linalg"}} & set(sys.modules)
assert not heavy, heavy
"""


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    "arguments", [["--help"], ["validate", "."], ["list", "."], ["schema"], ["explain", "amcl"], ["new", "x"]], ids=str
)
def test_commands_without_a_run_import_no_engine(simscen, arguments: list[str]) -> None:
    code = IMPORT_CHECK.format(arguments=arguments)
    result = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
