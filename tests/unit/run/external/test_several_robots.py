"""Tests of external stacks of several robots."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import make_reader
from stack_programs import DRIVE

from simscen.cli.session.backends import backend_of
from simscen.core.errors import RunError
from simscen.core.records.run_result import Outcome
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.run_files import execute_run
from simscen.run.sessions.run_session import SessionOptions, plan_jobs, run_session
from simscen.run.simulate import simulate

FLEET = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [8, 0], [8, 6], [0, 6], [0, 0]]}]}
robots:
  left: {pose: {x: 1, y: 4}, goals: [{name: desk, pose: {x: 2, y: 4}}], stack: {external: mine}}
  right: {pose: {x: 1, y: 1}, goals: [{name: desk, pose: {x: 2, y: 1}}], stack: {external: mine}}
  third: {pose: {x: 6, y: 3}}
time_limit: 4
pass: [{collisions: {max: 0}}]
"""
WRITE_PID = "with open('pid.' + os.environ['SIMSCEN_ROBOT'], 'w') as file: file.write(str(os.getpid()))\n"
PRINT_NAMES = WRITE_PID + "print(peer.robot_name, os.environ['SIMSCEN_ROBOT'], flush=True)\n"
HELLO = 'peer = Peer("mine", topics=["/odom"], about={"floor": 1})\n' + PRINT_NAMES
GOALS = "for step in peer:\n    if step.tick == 0: print(peer.task['goals'][0]['y'], flush=True)\n"
RIGHT = "if os.environ['SIMSCEN_ROBOT'] == 'right': "


@pytest.fixture
def load_fleet(program, tmp_path: Path):
    """Return a function that loads FLEET with the program as the stack of the robots `left` and `right`."""

    def load(text: str, **limits):
        file = tmp_path / "fleet.scenario.yaml"
        file.write_text(FLEET)
        loaded, command = load_scenario(file, tmp_path), program(text, **limits)
        robots = {
            name: replace(view, external_command=command if name != "third" else None)
            for name, view in loaded.robots.items()
        }
        return replace(loaded, robots=robots)

    return load


@pytest.fixture
def fleet(load_fleet):
    return lambda text, **limits: prepare(load_fleet(text, **limits))


def test_each_stack_gets_its_robot_name_and_has_its_own_output(fleet, tmp_path: Path) -> None:
    runs = []
    prepared = fleet(HELLO + DRIVE.replace("for step in peer:\n", GOALS))
    execute_run(prepared, 1, tmp_path, (), lambda *arguments: runs.append(arguments[1]))
    (run,) = runs
    assert run.result.outcome is Outcome.PASSED
    assert run.result.events["goal.reached"] == 2
    for name, y in (("left", "4.0"), ("right", "1.0")):
        words = (tmp_path / f"stack.{name}.log").read_text().split()
        assert words == [name, name, y]
        assert json.loads((tmp_path / f"stack.{name}.json").read_text())["about"] == {"floor": 1}
    assert not list(tmp_path.glob("stack*third*"))
    with (tmp_path / "run.mcap").open("rb") as stream:
        metadata = {record.name: record.metadata for record in make_reader(stream).iter_metadata()}
    assert {key: value for key, value in metadata["simscen.stack"].items() if key.endswith("external")} == {
        "left.external": "mine",
        "right.external": "mine",
    }


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("action", "kind", "message"),
    [
        ("os._exit(3)", "stack-crashed", "stack mine of robot `right`: its process exited 3"),
        ("time.sleep(60)", "stack-timeout", "stack mine of robot `right`: no answer to the step of t = 0.050 s"),
        ("peer._connection.send(b'garbage' * 9)", "stack-protocol", "stack mine of robot `right`: "),
        ("peer.give_up('no map')", "stack-failed", "stack mine of robot `right`: no map"),
    ],
)
def test_an_error_names_the_robot_and_ends_all_stacks(fleet, tmp_path, action, kind, message) -> None:
    steps = "for step in peer:\n    step.drive(0, 0)\n    if step.tick and peer.robot_name == 'right': "
    with pytest.raises(RunError) as raised:
        simulate(fleet(HELLO + steps + action, answer_limit=2.0), stack_log=tmp_path / "stack.log")
    assert (raised.value.kind, message in str(raised.value)) == (kind, True), str(raised.value)
    assert_stacks_are_ended(tmp_path)


def test_stack_without_welcome_is_reported_and_the_other_is_ended(fleet, tmp_path: Path) -> None:
    program_text = WRITE_PID + RIGHT + "time.sleep(60)\n"
    with pytest.raises(RunError, match=r"stack mine of robot `right`: no answer to HELLO within 1 s") as raised:
        simulate(fleet(program_text + HELLO + DRIVE, start_limit=1.0), stack_log=tmp_path / "stack.log")
    assert raised.value.kind == "stack-timeout"
    assert_stacks_are_ended(tmp_path)


def test_both_stacks_get_end_before_waiting(fleet, tmp_path: Path) -> None:
    """Each peer sends its last frame only after both peers have received END."""
    wait_for_other = (
        "say = peer._connection.send_json\n"
        "def meet(kind, content):\n"
        "    open(os.environ['SIMSCEN_ROBOT'], 'w').close()\n"
        "    while not all(map(os.path.exists, ('left', 'right'))): time.sleep(0.01)\n"
        "    print('met', flush=True)\n"
        "    say(kind, content)\n"
        "peer._connection.send_json = meet\n"
    )
    drive = HELLO + wait_for_other + "for step in peer: step.drive(0, 0)\n"
    assert simulate(fleet(drive), stack_log=tmp_path / "stack.log").result.outcome is Outcome.PASSED
    assert [(tmp_path / f"stack.{name}.log").read_text().split()[-1] for name in ("left", "right")] == ["met", "met"]


def test_killing_a_worker_ends_the_stacks_of_all_robots(load_fleet, tmp_path: Path) -> None:
    """The keeper is the parent of a stack, the worker the parent of the keeper."""
    kill = "os.kill(int(open(f'/proc/{os.getppid()}/stat').read().rsplit(')', 1)[1].split()[1]), signal.SIGKILL)\n"
    program_text = f"{HELLO}for step in peer:\n    if peer.robot_name == 'right': {kill}    step.drive(0, 0)\n"
    options = SessionOptions(wall_limit=60.0)
    jobs = plan_jobs([load_fleet(program_text, answer_limit=30.0)], options, tmp_path / "out")
    with backend_of(options) as backend:
        ((finished,), _) = run_session(jobs, options, backend, lambda event: None)
    assert finished.result.error is not None
    assert finished.result.error.kind == "crashed"
    assert_stacks_are_ended(tmp_path)


def assert_stacks_are_ended(folder: Path) -> None:
    for name in ("left", "right"):
        assert not Path(f"/proc/{(folder / f'pid.{name}').read_text()}").exists(), name


def test_a_single_robot_has_no_name(load, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A variable SIMSCEN_ROBOT in the environment of simscen has no effect."""
    monkeypatch.setenv("SIMSCEN_ROBOT", "somebody")
    print_name = "print(repr(peer.robot_name), 'SIMSCEN_ROBOT' in os.environ)\n"
    loaded = load('peer = Peer("mine", topics=["/odom"])\n' + print_name + DRIVE)
    simulate(prepare(loaded), stack_log=tmp_path / "stack.log")
    assert (tmp_path / "stack.log").read_text().split() == ["''", "False"]
