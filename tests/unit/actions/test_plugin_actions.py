"""Tests of the check that actions of installed packages do what their effect states."""

from typing import ClassVar

import pytest

from simscen.actions.base import Action, AnyAction
from simscen.core.errors import RunError
from simscen.core.stage import Effect, Stage
from simscen.spec.base import Spec
from simscen.spec.choice import Choice
from simscen.testing.fakes import FakeStage


class PushOther(Spec, Action):
    def perform(self, stage: Stage) -> Effect:
        stage.of("b").push((1.0, 0.0))
        return Effect(True, "pushed b")


class LookAtOther(Spec, Action):
    def perform(self, stage: Stage) -> Effect:
        return Effect(True, f"b is at {stage.of('b').robot.x} m")


class OfPackage(AnyAction):
    original_class: ClassVar[type[Choice] | None] = AnyAction


def test_plugin_action_may_change_another_robot() -> None:
    stage = FakeStage()
    assert OfPackage.model_construct(spawn=PushOther()).perform(stage) == Effect(True, "pushed b")
    assert stage.calls == [("push", (1.0, 0.0), None, 0.0)]


def test_plugin_action_that_only_reads_another_robot_has_changed_nothing() -> None:
    with pytest.raises(RunError, match="changed nothing"):
        OfPackage.model_construct(spawn=LookAtOther()).perform(FakeStage())
