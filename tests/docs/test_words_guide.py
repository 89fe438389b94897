"""Test that the guide to keys lists every trigger, action, fault, and criterion."""

import re
from pathlib import Path

import pytest

from simscen.actions.base import AnyAction
from simscen.criteria.registry import AnyCriterion
from simscen.faults.base import AnyFault
from simscen.triggers.base import Trigger

GUIDE = (Path(__file__).parents[2] / "docs" / "guides" / "words.md").read_text(encoding="utf-8")
PARTS = dict(re.findall(r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", GUIDE, re.MULTILINE | re.DOTALL))
CHOICES = {
    "When": [*Trigger.choices(), *(key.rstrip("_") for key in Trigger.modifiers if key != "robot")],
    "What happens": [*AnyAction.choices()],
    "What goes wrong": [*AnyFault.choices()],
    "What must hold": [*AnyCriterion.choices()],
}


@pytest.mark.parametrize("part", CHOICES)
def test_every_key_is_in_its_section(part):
    listed = re.findall(r"`([a-z_]+)`", PARTS[part])
    assert sorted(set(CHOICES[part]) - set(listed)) == []
