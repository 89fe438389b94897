"""Tests of the link between stack and base: command rate and command timeout."""

from simscen.core.geometry.kinematics import STOP, Twist
from simscen.run.faults.command_link import CommandLink

GO, FAST = Twist(0.3), Twist(0.5)


def test_commands_are_sent_at_the_rate_and_immediately_when_they_change():
    link = CommandLink(12, 120)
    commands = [GO] * 15 + [STOP] * 15
    assert [tick for tick, command in enumerate(commands) if link.send(tick, command)] == [0, 12, 15, 24]


def test_base_without_commands_keeps_the_last_one_and_stops_after_its_timeout():
    link = CommandLink(12, 120)
    link.receive(24, GO)
    assert [link.active_command(tick) for tick in (24, 100, 144, 145, 500)] == [GO, GO, GO, STOP, STOP]
    link.receive(600, FAST)
    assert link.active_command(606) == FAST


def test_timeout_shorter_than_the_command_period_does_not_stop_the_base():
    link = CommandLink(48, 12)
    link.receive(0, GO)
    assert link.active_command(47) == GO
