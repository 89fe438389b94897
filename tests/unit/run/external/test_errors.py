"""Tests of external stacks that crash, hang, or violate the protocol."""

import os
from pathlib import Path

import pytest

from simscen.core.errors import RunError

HELLO = 'peer = Peer("mine", topics=["/odom"])\n'
FIRST_STEP = HELLO + "steps = iter(peer); step = next(steps)\n"
"""Receives HELLO, sends WELCOME, and receives the first step."""
NO_WELCOME = "c = Connection.inherited(); c.receive()\n"
"""Receives HELLO, and sends nothing."""
WELCOMED = NO_WELCOME + 'c.send_json(wire.WELCOME, {"protocol": 1, "topics": []}); c.receive(); c.receive()\n'
"""Sends WELCOME, and receives GOAL and the first step, without the class Peer."""
NEXT_STEP = "\nnext(steps)"
COMMAND = "[(1, messages.twist(0.0, 0.0, 0.0))]"
NAN_POSE = "step.publish('/amcl_pose', messages.pose_with_covariance((0, 0), (float('nan'), 0, 0), [0] * 9))"
FOREVER = "while True: time.sleep(60)\n"


def run_error(play, text: str, **limits: float) -> RunError:
    """Return the error with which the run of the program ends."""
    with pytest.raises(RunError) as raised:
        play(text, **limits)
    return raised.value


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("print('out of memory'); sys.exit(3)", "its process exited 3"),
        (FIRST_STEP + "print('bye'); sys.exit(0)", "its process exited 0"),
        (FIRST_STEP + "os.kill(os.getpid(), signal.SIGKILL)", "its process was killed (SIGKILL)"),
        (FIRST_STEP + "os.kill(os.getpid(), signal.SIGSEGV)", "its process was killed (SIGSEGV)"),
        (FIRST_STEP + "raise KeyError('scan')", "its process exited 1"),
        (FIRST_STEP + "peer._connection.close(); time.sleep(60)", "closed its socket, but still runs"),
    ],
)
def test_a_stack_whose_process_ended_has_crashed(play, text: str, message: str) -> None:
    error = run_error(play, text)
    assert error.kind == "stack-crashed"
    assert message in str(error)


def test_a_crash_shows_the_end_of_the_output(play, tmp_path: Path) -> None:
    error = run_error(play, FIRST_STEP + "print('on the way', flush=True)\nraise KeyError('no scan')")
    assert error.tail.splitlines()[0] == "on the way"
    assert error.tail.splitlines()[-1] == "KeyError: 'no scan'"
    assert (tmp_path / "stack.log").read_text().strip() == error.tail


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FOREVER, "no answer to HELLO within 0.2 s"),
        (NO_WELCOME + FOREVER, "no answer to HELLO within 0.2 s"),
        (NO_WELCOME + "os.kill(os.getpid(), signal.SIGSTOP)", "no answer to HELLO within 0.2 s"),
    ],
)
def test_a_stack_without_welcome_is_a_timeout(play, text: str, message: str) -> None:
    error = run_error(play, text, start_limit=0.2)
    assert error.kind == "stack-timeout"
    assert message in str(error)


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    "text",
    [
        FIRST_STEP + FOREVER,
        FIRST_STEP + "os.kill(os.getpid(), signal.SIGSTOP)",
        FIRST_STEP + "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n" + FOREVER,
        FIRST_STEP + "peer._connection.send(bytes(3)); time.sleep(60)",
        FIRST_STEP + "while True: print('x' * 60000)",
    ],
)
def test_a_stack_without_answer_is_a_timeout(play, text: str) -> None:
    error = run_error(play, text, answer_limit=0.2)
    assert error.kind == "stack-timeout"
    assert "no answer to the step of t = 0.000 s (tick 0) within 0.2 s" in str(error)


@pytest.mark.sample(6)
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "c = socket.socket(fileno=int(os.environ['SIMSCEN_STACK_FD'])); c.sendall(b'GET / HTTP/1.1\\r\\n' * 9)\n",
            "bytes",
        ),
        (NO_WELCOME + "c.send(wire.frame(wire.WELCOME, b'{]'))", "its body is not JSON"),
        (NO_WELCOME + "c.send(wire.frame(wire.WELCOME, b'[1]'))", "its body is not a JSON object"),
        (NO_WELCOME + "c.send(wire.frame(wire.ANSWER, b''))", "its first frame is not a WELCOME"),
        (NO_WELCOME + "c.send(wire.frame(77, b''))", "its first frame is not a WELCOME"),
        (
            NO_WELCOME + "c.send_json(wire.WELCOME, {'protocol': 2})",
            "it uses protocol version 2, but simscen uses protocol version 1",
        ),
        (
            NO_WELCOME + "c.send_json(wire.WELCOME, {})",
            "it uses protocol version None, but simscen uses protocol version 1",
        ),
        (
            NO_WELCOME + "c.send_json(wire.WELCOME, {'protocol': 1, 'topics': ['/scam']})",
            "it requests the topic `/scam`, which does not exist",
        ),
        (NO_WELCOME + "c.send_json(wire.WELCOME, {'protocol': 1, 'topics': 'all'})", "`topics` is not a list"),
        (NO_WELCOME + "c.send_json(wire.WELCOME, {'protocol': 1, 'step': 'often'})", "`step` is 'often'"),
        (NO_WELCOME + "c.send_json(wire.WELCOME, {'protocol': 1, 'name': 7})", "`name` is not a text"),
        (NO_WELCOME + "c.send_json(wire.WELCOME, {'protocol': 1, 'about': 'x' * 10})", "`about` is not an object"),
        (WELCOMED + "c.send(bytes(4))", "a frame of 0 bytes"),
        (WELCOMED + f"c.send(wire.answer_frame(12, {COMMAND}))", "it answers tick 12 instead of 0"),
        (WELCOMED + "c.send(wire.frame(wire.WELCOME, b'{}'))", "a frame WELCOME instead of an ANSWER"),
        (WELCOMED + "c.send(wire.frame(wire.ANSWER, bytes(8)))", "it ends before its header is complete"),
        (
            WELCOMED + f"c.send(wire.frame(wire.ANSWER, wire.answer_frame(0, {COMMAND})[5:-1]))",
            "it ends before its last message is complete",
        ),
        (
            WELCOMED + f"c.send(wire.frame(wire.ANSWER, wire.answer_frame(0, {COMMAND})[5:] + b'x'))",
            "there are more bytes after its last message",
        ),
        (WELCOMED + "c.send(wire.answer_frame(0, [(99, b'')]))", "a message on topic number 99, which does not exist"),
        (WELCOMED + "c.send(wire.answer_frame(0, []))", "no message on /cmd_vel, though a command is due"),
        (WELCOMED + f"c.send(wire.answer_frame(0, 2 * {COMMAND}))", "two commands in one answer"),
        (
            WELCOMED + f"c.send(wire.answer_frame(0, {COMMAND}) * 2); c.receive(); time.sleep(60)",
            "it answers tick 0 instead of 12",
        ),
        (
            WELCOMED + "c.send(wire.answer_frame(0, [(1, b'')]))",
            "not a valid geometry_msgs/msg/Twist: a message is not plain CDR",
        ),
        (
            WELCOMED + "c.send(wire.answer_frame(0, [(1, bytes([0, 1, 0, 0]) + bytes(40))]))",
            "not a valid geometry_msgs/msg/Twist",
        ),
        (WELCOMED + "c.send(wire.answer_frame(0, [(1, bytes([0, 1, 0, 0]) + bytes(64))]))", "longer than its type"),
        (FIRST_STEP + "step.drive(float('nan'), 0.0)" + NEXT_STEP, "a command that is not finite: nan, 0, 0"),
        (FIRST_STEP + "step.drive(0.0, float('-inf'))" + NEXT_STEP, "a command that is not finite: 0, 0, -inf"),
        (FIRST_STEP + NAN_POSE + NEXT_STEP, "a pose on /amcl_pose that is not finite"),
        (
            FIRST_STEP + "step.publish('/plan', messages.path((0, 0), [(float('inf'), 0, 0)]))" + NEXT_STEP,
            "a path on /plan that is not finite",
        ),
        (
            FIRST_STEP + "step.publish('/plan/exact', messages.float64_array([1.0, 2.0]))" + NEXT_STEP,
            "2 numbers, which cannot be split into rows of 3",
        ),
        (
            FIRST_STEP + "step.publish('/simscen/events', messages.string('{'))" + NEXT_STEP,
            "not a valid std_msgs/msg/String",
        ),
        (
            FIRST_STEP + "step.publish('/simscen/events', messages.string('[' * 100000))" + NEXT_STEP,
            "not a valid std_msgs/msg/String",
        ),
        (
            FIRST_STEP + "step.publish('/simscen/events', messages.string('7'))" + NEXT_STEP,
            "its body is not a JSON object",
        ),
        (
            FIRST_STEP + "peer.goals.report('collision.ended', 'wall')" + NEXT_STEP,
            "`collision.ended`, which a stack may not report",
        ),
        (FIRST_STEP + "peer.goals.report('run.ended')" + NEXT_STEP, "`run.ended`, which a stack may not report"),
        (
            FIRST_STEP + "peer.goals.report('navigation.ended', 'SUCCEEDED')" + NEXT_STEP,
            "`navigation.ended`, which a stack may",
        ),
    ],
)
def test_protocol_violations_are_reported(play, text: str, message: str) -> None:
    error = run_error(play, text)
    assert error.kind == "stack-protocol"
    assert message in str(error)


def test_a_stack_that_gives_up_before_the_first_step_gives_its_reason(play) -> None:
    error = run_error(play, HELLO + "peer.give_up('no map server is active')")
    assert (error.kind, str(error)) == ("stack-failed", "stack mine: no map server is active")


def test_a_stack_that_gives_up_during_the_run_gives_its_reason(play) -> None:
    error = run_error(play, FIRST_STEP + "peer.give_up('the battery is empty')")
    assert (error.kind, str(error)) == ("stack-failed", "stack mine: the battery is empty")


@pytest.mark.parametrize("argv", [("/no/such/program",), ("no-such-program", "-x"), ("/etc/passwd",)])
def test_a_program_that_cannot_be_started_is_reported(load, argv: tuple[str, ...]) -> None:
    from dataclasses import replace

    from simscen.run.preparation import prepare
    from simscen.run.simulate import simulate

    loaded = load("")
    assert loaded.external_command is not None
    with pytest.raises(RunError, match=r"its process cannot be started: (No such file|Permission denied)") as raised:
        simulate(prepare(replace(loaded, external_command=replace(loaded.external_command, argv=argv))))
    assert raised.value.kind == "stack-crashed"


def test_all_processes_of_a_stack_are_killed_after_the_run(play, tmp_path: Path) -> None:
    """The children of the stack have their own session, close their streams, and ignore SIGTERM."""
    escape = (
        "def escape(name):\n"
        "    if os.fork() == 0:\n"
        "        os.setsid()\n"
        "        if os.fork() == 0:\n"
        "            signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "            open(name, 'w').write(str(os.getpid()))\n"
        "            os.closerange(0, 64)\n"
        "            while True: time.sleep(60)\n"
        "        os._exit(0)\n"
        "    os.wait()\n"
        "    while not os.path.exists(name) or not open(name).read(): time.sleep(0.001)\n"
    )
    run_error(play, escape + FIRST_STEP + "escape('a.pid')\nsys.exit(3)")
    play(escape + HELLO + "escape('b.pid')\n" + "for step in peer: step.drive(0.0, 0.0)\n", time_limit="0.5")
    for name in ("a.pid", "b.pid"):
        with pytest.raises(ProcessLookupError):
            os.kill(int((tmp_path / name).read_text()), 0)
