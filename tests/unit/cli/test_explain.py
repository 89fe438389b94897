"""Tests of `simscen explain`."""

from pathlib import Path

import pytest
from pydantic import ValidationError

import simscen as package
from simscen.cli.catalog import topic_lookup
from simscen.cli.catalog.code_topics import EXTERNAL_ONLY_CODES, NAV2_ERROR_CODES
from simscen.cli.catalog.topic_lookup import known_names
from simscen.cli.commands import explain
from simscen.cli.commands.explain import explanation
from simscen.core.errors import Exit
from simscen.core.messages.navigation import ErrorCode
from simscen.model.robot import Limits


def test_explain_without_a_name_lists_everything(simscen) -> None:
    out = simscen("explain").out
    for name in ("trigger:", "stopped_within", "amcl", "slip", "spawn", "robot_within"):
        assert name in out


def test_topic_is_explained_with_keys_units_defaults_and_example(simscen) -> None:
    out = simscen("explain", "collisions").out
    assert out.startswith("collisions (criterion)\n")
    assert "max_impulse: impulse in N s" in out
    assert "caused_by_robot: true or false (default false)" in out
    assert "Example: collisions: {max: 0}" in out


def test_value_without_keys_is_explained(simscen) -> None:
    assert "Value: duration in s" in simscen("explain", "trigger.time").out


def test_ambiguous_name_explains_all_topics(simscen) -> None:
    out = simscen("explain", "localization_error").out
    assert "localization_error (trigger)" in out
    assert "localization_error (criterion)" in out
    assert "(trigger)" not in simscen("explain", "criterion.localization_error").out


def test_codes_are_explained(simscen) -> None:
    assert simscen("explain", "sc012").out == "SC012\n  A key is unknown in this mapping.\n"


def test_codes_of_other_stacks_are_marked(simscen) -> None:
    assert "The reference stack never returns this code" in simscen("explain", "107").out.replace("\n  ", " ")
    stack = Path(package.__file__).parent / "stack"
    sources = [path.read_text(encoding="utf-8") for path in stack.rglob("*.py")]
    returned_codes = {code for code in ErrorCode if any(f"ErrorCode.{code.name}" in text for text in sources)}
    assert set(ErrorCode) - returned_codes - {ErrorCode.NONE} <= EXTERNAL_ONLY_CODES


def test_backup_never_has_invalid_input_because_every_robot_can_reverse() -> None:
    assert ErrorCode.BACKUP_INVALID_INPUT in EXTERNAL_ONLY_CODES
    base = {"linear": 1.0, "angular": 1.0, "linear_acceleration": 1.0, "angular_acceleration": 1.0}
    assert Limits.model_validate({**base, "reverse": 0.1}).reverse == 0.1
    with pytest.raises(ValidationError, match="reverse"):
        Limits.model_validate({**base, "reverse": 0.0})


@pytest.mark.parametrize(("name", "hint"), [("collision_s", "did you mean"), ("zzzzzz", "for a list")])
def test_unknown_name_is_a_usage_error(simscen, name: str, hint: str) -> None:
    result = simscen("explain", name)
    assert result.code == 2
    assert hint in result.err


def test_output_fits_a_narrow_terminal(simscen, monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "50")
    text = [line for line in simscen("explain", "stopped_within").out.splitlines() if not line.startswith("  Example")]
    prose = [line for line in text if ": " not in line]
    assert max(map(len, prose)) <= 50


def test_signals_are_listed_with_units_and_explained(simscen) -> None:
    out = simscen("explain", "signals").out
    assert "clearance: length in m\n" in out
    assert "in_region: yes or no\n" in out
    assert "40\n  Hz" in out or "40 Hz" in out
    assert "Example: {signal: distance_to, object: cart" in simscen("explain", "distance_to").out
    assert "clearance (signal)" in simscen("explain", "clearance").out


@pytest.mark.parametrize(
    ("name", "expected_text"),
    [
        ("goals.pose", "place or mapping (required)"),
        ("goals.pose", "yaw: angle in rad"),
        ("amcl.update_min_a", "angle in rad, 0 … 6.3 (default 0.2)"),
        ("update_min_a", "amcl.update_min_a (key)"),
        ("stack.localizer.alpha1", "Rotation noise from rotation."),
        ("events.when", "Trigger of the event."),
        ("sensors.lidar.mount.yaw", "0: straight ahead, positive: to the"),
        ("physics.tick_rate", "frequency in Hz"),
        ("GOAL_OCCUPIED", "Nav2's error code 206."),
        ("306", "GOAL_OCCUPIED (error code)"),
        ("206", "GOAL_OCCUPIED (error code)"),
        ("stack-timeout", "An external stack did not answer"),
        ("exit 3", "could not be completed"),
        ("5", "Nothing was selected"),
    ],
)
def test_keys_and_codes_are_explained(simscen, name: str, expected_text: str) -> None:
    result = simscen("explain", name)
    assert result.code == 0, result.err
    assert expected_text in result.out


@pytest.mark.parametrize(
    ("name", "suggestion"),
    [("amcl.update_min_b", "amcl.update_min_"), ("goal_ocupied", "GOAL_OCCUPIED"), ("lingr", "linger")],
)
def test_misspelled_keys_and_codes_get_a_suggestion(simscen, name: str, suggestion: str) -> None:
    assert f"did you mean `{suggestion}" in simscen("explain", name).err


def test_every_topic_every_key_and_every_code_is_explained(monkeypatch, is_quick: bool) -> None:
    """`make test` asks for every fifth key only."""
    topics = topic_lookup.all_topics()
    for module in (explain, topic_lookup):
        monkeypatch.setattr(module, "all_topics", lambda: topics)  # collecting the topics takes most of the time
    for name in [*known_names(), *list(known_names(keys=True))[:: 5 if is_quick else 1]]:
        assert explanation(name), name


def test_every_nav2_code_and_exit_code_has_a_description() -> None:
    assert set(NAV2_ERROR_CODES) == set(ErrorCode)
    assert {f"exit {code.value}" for code in Exit} <= set(known_names())
