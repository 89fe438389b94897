"""Tests of the communication with external stacks: slow answers, large messages, rates, and contents."""

from pathlib import Path

import numpy as np
import pytest
from stack_programs import DRIVE

from simscen.core.records.events import EventKind

HELLO = 'peer = Peer("mine", topics=["/odom", "/scan"])\n'


def test_a_slow_stack_gives_the_same_run_as_a_fast_one(play, tmp_path: Path) -> None:
    play(HELLO + DRIVE)
    fast = (tmp_path / "run.mcap").read_bytes()
    play(HELLO + DRIVE.replace("for step in peer:\n", "for step in peer:\n    if step.tick == 120: time.sleep(0.2)\n"))
    assert (tmp_path / "run.mcap").read_bytes() == fast


def test_big_answers_and_big_frames_do_not_block_each_other(play) -> None:
    """simscen sends a map of 4 million cells; the stack sends plans of 10 MB and prints 1 MB in each step."""
    large_plan = (
        "points = [float(k) for k in range(3)] * 420_000\n"
        "for step in peer:\n"
        "    print('x' * 1_000_000)\n"
        "    if step.tick == 12: step.publish('/plan/exact', messages.float64_array(points))\n"
        "    step.drive(0.0, 0.0)\n"
    )
    walls = "[{points: [[0, 0], [100, 0], [100, 100], [0, 100], [0, 0]]}]"
    run = play(
        'peer = Peer("mine", topics=["/map"])\n' + large_plan,
        world=f"{{simscen: 1, walls: {walls}}}",
        time_limit="0.2",
    )
    assert [len(plan.points) for plan in run.trace.plans] == [420_000]


@pytest.mark.parametrize(("every", "ticks"), [("True", {6, 12, 18, 24}), ("False", {12, 24})])
def test_steps_are_sent_for_each_command_or_for_each_reading(play, tmp_path: Path, every, ticks) -> None:
    hello = f'peer = Peer("mine", topics=["/odom"], every_beat={every})\n'
    text = "for step in peer:\n    print(step.tick, step.command_due, len(step.messages))\n    step.drive(0.0, 0.0)\n"
    play(hello + text, time_limit="0.1")
    lines = [line.split() for line in (tmp_path / "stack.log").read_text().splitlines()]
    assert {int(tick) for tick, *_ in lines if int(tick)} == ticks
    assert {int(tick) for tick, due, _ in lines if due == "True"} == {0, 12, 24}
    assert sum(int(count) for *_, count in lines) == 5  # each reading is sent once in both cases


def test_messages_to_the_stack_equal_those_in_the_log(play, tmp_path: Path) -> None:
    from mcap.reader import make_reader

    text = "import binascii\nfor step in peer:\n    for m in step.messages: print(m.topic, binascii.crc32(m.raw))\n"
    topics = ["/scan", "/odom", "/imu", "/tf_static", "/map", "/robot_description"]
    play(f'peer = Peer("mine", topics={topics}, every_beat=True)\n{text}    step.drive(0.3, 0.1)\n', time_limit="1")
    received = [tuple(line.split()) for line in (tmp_path / "stack.log").read_text().splitlines()]
    import binascii

    with (tmp_path / "run.mcap").open("rb") as stream:
        messages = list(make_reader(stream).iter_messages(topics))
    for topic in topics:
        logged = [str(binascii.crc32(message.data)) for _, channel, message in messages if channel.topic == topic]
        assert [crc for name, crc in received if name == topic] == logged
        assert logged


def test_a_belief_without_a_transform_corrects_the_odometry(play, tmp_path: Path) -> None:
    text = HELLO + (
        "for step in peer:\n"
        "    odom = step.get('/odom')\n"
        "    x, y, yaw = odom.pose if odom else (0, 0, 0)\n"
        "    step.publish('/amcl_pose', messages.pose_with_covariance(step.stamp, (x + 3, y + 4, yaw), [0.1] * 9))\n"
        "    step.drive(0.4, 0.5)\n"
    )
    from mcap.reader import make_reader

    from simscen.record.messages.decode import MessageReader, transforms

    run = play(text, time_limit="1")
    assert run.trace.belief.values[-1][:2] == pytest.approx(
        run.trace.odometry.values[-1][:2] + np.array([3, 4]), abs=1e-9
    )
    with (tmp_path / "run.mcap").open("rb") as stream:
        links = [
            link for _, _, m in make_reader(stream).iter_messages(["/tf"]) for link in transforms(MessageReader(m.data))
        ]
    corrections = [link.pose for link in links if link.child == "odom"]
    assert corrections[-1][:2] == pytest.approx((3, 4), abs=1e-9)


def test_a_command_holds_until_the_next_one(play) -> None:
    run = play(HELLO + "for step in peer:\n    if step.tick == 0: step.drive(0.2, 0.0)\n", time_limit="1")
    assert {tuple(row) for row in run.trace.command.values} == {(0.2, 0.0, 0.0)}


def test_an_empty_plan_clears_the_current_plan(play) -> None:
    """An event that spawns an object on the plan has no effect without a plan."""
    events = "[{when: {time: 0.5}, do: {spawn: {name: box, box: [0.1, 0.1, 0.1], on_plan: 0.5}}, required: false}]"
    text = HELLO + (
        "for step in peer:\n"
        "    if step.tick == 12: step.publish('/plan', messages.path(step.stamp, [(1, 1, 0), (4, 1, 0)]))\n"
        "    if step.tick == {}: step.publish('/plan', messages.path(step.stamp, []))\n"
        "    step.drive(0.0, 0.0)\n"
    )
    for clearing_tick, is_spawned in ((108, False), (132, True)):
        run = play(text.replace("{}", str(clearing_tick)), events=events, time_limit="1")
        (ended,) = run.trace.of_kind(EventKind.EVENT_ENDED)
        assert [effect["happened"] for effect in ended.data["effects"]] == [is_spawned]
        assert len(run.trace.plans) == 1


def test_stack_with_ground_truth_corrects_wheel_odometry(play, tmp_path: Path) -> None:
    """The ground truth is also an odometry message, but its frame is not `odom`."""
    from mcap.reader import make_reader

    from simscen.record.messages.decode import MessageReader, transforms

    text = 'peer = Peer("mine", topics=["/sensor_ground_truth/odom"])\nfor step in peer:\n' + (
        "    x, y, yaw = step.get('/sensor_ground_truth/odom').pose\n"
        "    step.publish('/amcl_pose', messages.pose_with_covariance(step.stamp, (x, y, yaw), [0.1] * 9))\n"
        "    step.drive(0.4, 0.5)\n"
    )
    play(text, time_limit="1", stack="{external: mine, ground_truth: true}")
    with (tmp_path / "run.mcap").open("rb") as stream:
        links = [
            link for _, _, m in make_reader(stream).iter_messages(["/tf"]) for link in transforms(MessageReader(m.data))
        ]
    corrections = [link.pose for link in links if link.child == "odom"]
    assert corrections[-1][:2] == pytest.approx((1, 1), abs=0.05)  # the start pose, at which the wheel odometry is zero


def test_a_plan_sent_with_the_end_of_a_goal_belongs_to_the_next_goal(play) -> None:
    events = "[{when: {time: 0.5}, do: {spawn: {name: box, box: [0.1, 0.1, 0.1], on_plan: 0.5}}, required: false}]"
    text = HELLO + (
        "for step in peer:\n"
        "    peer.goals.accept()\n"
        "    if step.tick == 12:\n"
        "        peer.goals.failed(208, go_on=True)\n"
        "        peer.goals.accept()\n"
        "        step.publish('/plan', messages.path(step.stamp, [(1, 1, 0), (4, 1, 0)]))\n"
        "    step.drive(0.0, 0.0)\n"
    )
    goals = "[{name: a, pose: {x: 2, y: 1}}, {name: b, pose: {x: 4, y: 1}}]"
    run = play(text, events=events, goals=goals, on_goal_failure="continue", time_limit="1")
    (ended,) = run.trace.of_kind(EventKind.EVENT_ENDED)
    assert [effect["happened"] for effect in ended.data["effects"]] == [True]


@pytest.mark.parametrize(("end_s", "times_with_longer_limit"), [(0.1, {0.0, 0.05, 0.1}), (0, {0.0})])
def test_a_stack_may_take_longer_for_its_first_answers(
    play, tmp_path: Path, end_s: float, times_with_longer_limit: set[float]
) -> None:
    raw = (
        "c = Connection.inherited(); c.receive()\n"
        f"welcome = {{'protocol': 1, 'topics': [], 'first_answer_limit': 60, 'first_answer_until': {end_s}}}\n"
        "c.send_json(wire.WELCOME, welcome); c.receive()\n"
        "while True:\n"
        "    kind, body = c.receive()\n"
        "    if kind == wire.END: break\n"
        "    header, _ = wire.from_step(body)\n"
        "    print(header.tick, header.deadline)\n"
        "    c.send(wire.answer_frame(header.tick, [(1, messages.twist(0.0, 0.0, 0.0))]))\n"
        "c.send_json(wire.BYE, {})\n"
    )
    play(raw, time_limit="0.2")
    lines = [line.split() for line in (tmp_path / "stack.log").read_text().splitlines()]
    deadlines = {int(tick) / 240: int(deadline) / 1000 for tick, deadline in lines}
    assert deadlines == {
        time: 60.0 if time in times_with_longer_limit else 20.0 for time in (0.0, 0.05, 0.1, 0.15, 0.2)
    }
