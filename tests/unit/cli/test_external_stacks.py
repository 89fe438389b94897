"""Tests of commands of external stacks from the command line and the user configuration."""

import sys
from pathlib import Path

import pytest

from simscen.cli.process import caller_environment, config_file
from simscen.cli.session.selection import Selection, load_selection
from simscen.core.errors import UsageError
from simscen.run.reproducibility import scenario_digests

SHORT = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}], regions: {r: [[0, 0], [1, 0], [1, 1]]}}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""
MINE = (
    SHORT
    + "stack: {external: mine, controller_frequency: 10 Hz, keepout: [r], goal_checker: {xy_goal_tolerance: 0.1}}\n"
)


@pytest.fixture
def project(simscen, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with scenarios with and without a named stack, a program, and an empty configuration folder."""
    (tmp_path / "good.scenario.yaml").unlink()
    (tmp_path / "mine.scenario.yaml").write_text(MINE)
    (tmp_path / "plain.scenario.yaml").write_text(SHORT)
    (tmp_path / "nav").write_text("#!/bin/sh\n")
    (tmp_path / "nav").chmod(0o755)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    return tmp_path


def configure(project: Path, text: str) -> Path:
    """Write the user configuration, and return its file."""
    file = project / "home/simscen/config.yaml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    return file


def loaded(name: str, *stacks: str):
    """Return the scenarios that are run for a scenario file and values of `--stack`."""
    return load_selection([Path(f"{name}.scenario.yaml")], None, [], False, Selection(), stacks)[0]


def test_undefined_stack_name_is_an_error_with_its_location(simscen, project: Path) -> None:
    result = simscen("run", ".")
    assert result.code == 2
    assert "mine.scenario.yaml:7:19: error[SC060] the external stack `mine` has no command" in result.err
    assert "--stack mine='COMMAND'" in result.err
    assert not (project / "simscen-out").exists()


def test_undefined_stack_name_is_a_warning_in_validate(simscen, project: Path) -> None:
    result = simscen("validate", "mine.scenario.yaml")
    assert result.code == 0
    assert "mine.scenario.yaml:7:19: warning[SC060]" in result.out
    checked = simscen("validate", "mine.scenario.yaml", "--stack", "mine=./nav --fast")
    assert (checked.code, checked.out) == (0, "1 scenario is valid\n")


@pytest.mark.parametrize(
    ("stack_option", "expected_text"),
    [
        ("mine=./nowhere", "--stack mine=./nowhere: no such file or directory: `./nowhere`"),
        ("mine=./notes.txt", "permission denied: `./notes.txt` is not executable"),
        ("mine=./plain.scenario.yaml", "plain.scenario.yaml:1:1: error[SC010] missing key `stack`"),
        ("mine=./home", "`./home` is a folder, not a program"),
        ("mine=no-such-program-anywhere -x", "no program `no-such-program-anywhere` in the PATH"),
        ("mine='unclosed", "cannot be read as a command: no closing quotation"),
        ("mine=", "names no program"),
        ("mine=''", "names no program"),
        ("mein", "`mein` is neither a stack type nor a name in"),
        ("refrence", "did you mean `reference`?"),
    ],
)
@pytest.mark.parametrize("command", ["run", "validate"])
def test_unusable_program_is_reported_before_any_run(simscen, project, command, stack_option, expected_text) -> None:
    (project / "home").mkdir()
    (project / "notes.txt").write_text("none\n")
    result = simscen(command, ".", "--stack", stack_option)
    assert result.code == 2
    assert expected_text in result.err


def test_command_line_overrides_the_configuration(project: Path) -> None:
    configure(project, "stacks: {mine: {command: sh -c true}, other: {command: ./nav --other}}\n")
    assert loaded("mine")[0].external_command.argv == ("sh", "-c", "true")
    assert loaded("mine", "mine=./nav 'a b'")[0].external_command.argv == ("./nav", "a b")
    scenarios = loaded("mine", "mine", "x=other", "ref=reference")
    assert [
        (scenario.stack_name, scenario.external_command and scenario.external_command.argv) for scenario in scenarios
    ] == [
        ("mine", ("sh", "-c", "true")),
        ("x", ("./nav", "--other")),
        ("ref", None),
    ]


def test_command_keeps_the_scenario_parameters_of_the_stack(project: Path) -> None:
    for name in ("mine", "v2"):
        stack = loaded("mine", f"{name}=./nav")[0].spec.stack
        assert (stack.external, stack.controller_frequency, stack.keepout) == (name, 10.0, ["r"])
    assert loaded("plain", "v2=./nav")[0].spec.stack.external == "v2"


def test_stack_file_can_name_an_external_stack(project: Path) -> None:
    (project / "slow.stack.yaml").write_text("simscen: 1\nstack: {external: mine, controller_frequency: 5 Hz}\n")
    configure(project, "stacks: {mine: {command: ./nav --slow}}\n")
    (scenario,) = loaded("plain", "slow=slow.stack.yaml")
    assert (scenario.spec.stack.controller_frequency, scenario.external_command.argv) == (5.0, ("./nav", "--slow"))


def test_goal_tolerances_of_the_scenario_apply_to_every_stack(project: Path) -> None:
    (project / "lax.stack.yaml").write_text(
        "simscen: 1\nstack: {goal_checker: {xy_goal_tolerance: 1, stateful: false}}\n"
    )
    for stack_option in ("ref=reference", "lax=lax.stack.yaml", "v2=./nav"):
        stack = loaded("mine", stack_option)[0].spec.stack
        assert stack.goal_checker.xy_goal_tolerance == 0.1
        assert stack.keepout == ["r"]
    assert loaded("mine", "lax=lax.stack.yaml")[0].spec.stack.goal_checker.stateful is False
    assert loaded("mine", "ref=reference")[0].spec.stack.controller_frequency == 10.0


def test_configuration_sets_limits_folder_and_variables(project: Path, monkeypatch) -> None:
    monkeypatch.setenv("HOME", str(project))
    monkeypatch.setenv("ROS_DOMAIN_ID", "1")
    monkeypatch.setenv("PYTHONPATH", "/opt/mine")
    text = "{command: ./nav, cwd: ~/, env: {ROS_DOMAIN_ID: '7'}, start_limit: 2 min, answer_limit: 500 ms}"
    configure(project, f"stacks: {{mine: {text}}}\n")
    (project / "deep").mkdir()
    monkeypatch.chdir(project / "deep")
    (scenario,) = load_selection([project / "mine.scenario.yaml"], None, [], False, Selection(), ())[0]
    stack_command = scenario.external_command
    assert stack_command is not None
    assert (stack_command.cwd, stack_command.start_limit, stack_command.answer_limit) == (f"{project}", 120.0, 0.5)
    assert (stack_command.env["ROS_DOMAIN_ID"], stack_command.env["PYTHONPATH"]) == ("7", "/opt/mine")


def test_stack_gets_the_environment_of_the_caller(simscen, project: Path, monkeypatch) -> None:
    """Variables that simscen sets for itself have no effect."""
    monkeypatch.delenv("PYDANTIC_DISABLE_PLUGINS", raising=False)
    monkeypatch.setenv("SOME_SECRET", "x")
    simscen("list", ".")
    assert "PYDANTIC_DISABLE_PLUGINS" not in caller_environment()
    assert caller_environment()["SOME_SECRET"] == "x"


def test_configuration_is_in_xdg_config_home(monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    for stack_option in ("", "relative/is/ignored"):
        monkeypatch.setenv("XDG_CONFIG_HOME", stack_option)
        assert config_file() == tmp_path / ".config/simscen/config.yaml"
    monkeypatch.setenv("XDG_CONFIG_HOME", "/etc/x")
    assert config_file() == Path("/etc/x/simscen/config.yaml")


WRONG = """\
stack: {}
stacks:
  mine:
    command: "./nav 'x"
    env: {ROS_DOMAIN_ID: 7, A-B: x}
    cwd: relative
    answer_limit: 0
    comand: x
"""


def test_errors_in_the_configuration_have_locations(simscen, project: Path) -> None:
    file = configure(project, WRONG)
    result = simscen("run", "mine.scenario.yaml")
    assert result.code == 2
    locations = [line.partition(" ")[0] for line in result.err.splitlines() if line.startswith(str(file))]
    positions = [location.removeprefix(str(file)) for location in locations]
    assert positions == [":1:1:", ":4:14:", ":5:26:", ":5:29:", ":6:10:", ":7:19:", ":8:5:"]
    assert "put it in quotes" in result.err


def test_configuration_is_read_only_if_needed(simscen, project: Path) -> None:
    configure(project, WRONG)
    assert simscen("validate", "plain.scenario.yaml").code == 0
    assert simscen("validate", "mine.scenario.yaml", "--stack", "mine=./nav").code == 0


def test_missing_program_is_reported_at_its_line_of_the_configuration(simscen, project: Path) -> None:
    file = configure(project, "stacks:\n  mine: {command: ./gone}\n")
    result = simscen("run", "mine.scenario.yaml")
    assert result.code == 2
    assert f"{file}:2:19: error[SC061] no such file or directory: `./gone`" in result.err


def test_digest_includes_arguments_variables_and_file_contents(project: Path, monkeypatch) -> None:
    def digest_with(*stack_option: str) -> str:
        return scenario_digests(loaded("mine", *stack_option)[0]).run

    original = digest_with("mine=./nav --map map.yaml")
    assert digest_with("mine=./nav --map map.yaml") == original
    monkeypatch.setenv("TERM_SESSION", "another shell")
    assert digest_with("mine=./nav --map map.yaml") == original
    assert digest_with("mine=./nav --map other.yaml") != original
    (project / "map.yaml").write_text("x")
    assert (with_map := digest_with("mine=./nav --map map.yaml")) != original
    (project / "nav").write_text("#!/bin/sh\nexit 1\n")
    assert digest_with("mine=./nav --map map.yaml") != with_map
    configure(project, "stacks: {mine: {command: ./nav, env: {A: '1'}}}\n")
    with_variable = digest_with()
    configure(project, "stacks: {mine: {command: ./nav, env: {A: '2'}}}\n")
    assert digest_with() != with_variable


@pytest.mark.parametrize("command", ["python3 pkg/main.py", "python3 -m pkg", "python3 -m pkg.main"])
def test_digest_includes_modules_next_to_a_python_script(project: Path, command: str) -> None:
    (project / "pkg/deep").mkdir(parents=True)
    for name in ("__init__.py", "__main__.py", "main.py", "planner.py", "deep/map.py", "notes.txt"):
        (project / "pkg" / name).write_text("")
    (project / "pkg/venv").mkdir()

    def digest() -> str:
        return scenario_digests(loaded("mine", f"mine={command}")[0]).run

    original = digest()
    (project / "pkg/notes.txt").write_text("not code")
    (project / "pkg/venv/other.py").write_text("not of the stack")
    assert digest() == original
    (project / "pkg/planner.py").write_text("gain = 2")
    assert (changed := digest()) != original
    (project / "pkg/deep/map.py").write_text("size = 2")
    assert digest() != changed


def test_simscen_is_found_without_an_activated_environment(project: Path, monkeypatch) -> None:
    """The ROS 2 adapter is such a command: `--stack mine='simscen ros2 …'`."""
    monkeypatch.setenv("PATH", "/nowhere")
    assert loaded("mine", "mine=simscen ros2")[0].external_command.argv == (
        str(Path(sys.executable).parent / "simscen"),
        "ros2",
    )
    with pytest.raises(UsageError, match="no program `sh` in the PATH"):
        loaded("mine", "mine=sh -c true")


def test_program_is_searched_in_the_path_of_its_environment(project: Path) -> None:
    (project / "bin").mkdir()
    (project / "bin/only-here").write_text("#!/bin/sh\n")
    (project / "bin/only-here").chmod(0o755)
    configure(project, f"stacks: {{mine: {{command: only-here, env: {{PATH: {project}/bin}}}}}}\n")
    assert loaded("mine")[0].external_command.argv == ("only-here",)
