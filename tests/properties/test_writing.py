"""Property tests of YAML output: it is read back equal."""

from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.loading.scenario import load_scenario
from simscen.loading.scenario_text import resolved_text
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.textfile import read_text
from simscen.loading.yaml.writing import to_yaml, world_text
from simscen.model.world import WorldSpec
from tests.scenario_files import spec_of_text

AMBIGUOUS_TEXTS = [
    *("1e3", "on", "off", "yes", "0o7", "017", "0x1f", "1:30", "12:30:45", "1_000", ".5", ".inf", ".nan", "null", "~"),
    *("", " ", "true", "2026-11-21", "<<", "=", "!tag", "&a", "*a", "- a", "a: b", "a #b", "#", "%", "@", "`", "'"),
    *('"', "\\", "a\nb", "\n", " a", "a ", "\t", "\x7f", "\x85", "\xa0", "\u2028", "\u202e", "\ufeff", "\U0001f916"),
    *("9" * 25, "-", "--- a", "...", "?", "? a", "|", ">", "[", "]", "{", "}", ",", "Ü", "+1", "1.", "0.0", "NULL"),
]
TEXTS = st.sampled_from(AMBIGUOUS_TEXTS) | st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
NUMBERS = st.integers(-(10**17), 10**17) | st.floats(allow_nan=False)
SCALARS = TEXTS | NUMBERS | st.booleans()
KEYS = TEXTS.filter(lambda text: text != "<<")
TREES = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4), max_leaves=12
)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a file in a temporary folder."""
    return tmp_path_factory.mktemp("yaml") / "a.yaml"


@given(data=st.dictionaries(KEYS, TREES, max_size=4))
@settings(max_examples=3 * settings.default.max_examples, deadline=None)
def test_written_yaml_is_read_back_equal_with_types(file: Path, data: dict[str, Any]) -> None:
    """The text is written to a file, because the reader refuses control characters in files."""
    file.write_text(to_yaml(data), encoding="utf-8", newline="")
    text = read_text(file, "a")
    assert isinstance(text, str), text
    tree, problems = parse_yaml(text, "a")
    assert not problems
    assert tree is not None and repr(tree.plain) == repr(data)


@pytest.mark.parametrize("name", ["1e3", "on", "0o7", "1:30", "no", "017", "2026-11-21"])
def test_ambiguous_name_is_quoted_in_a_merged_scenario(tmp_path: Path, name: str) -> None:
    """Regression: YAML 1.1 wrote the name of a goal without quotes, and YAML 1.2 read it as a number."""
    (tmp_path / "base.scenario.yaml").write_text(
        "simscen: 1\nworld: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}\n"
        "robot: {pose: {x: 1, y: 1}}\npass: [{goals_reached: {}}]\n"
    )
    file = tmp_path / "a.scenario.yaml"
    file.write_text(f'extends: base.scenario.yaml\ngoals: [{{name: "{name}", pose: {{x: 5, y: 3}}}}]\n')
    text = resolved_text(load_scenario(file, tmp_path))
    assert spec_of_text(text, "log").goals[0].name == name


def test_a_world_that_is_written_is_read_back_with_its_names() -> None:
    """Regression: `simscen world convert` wrote a world called 0o7, which was read as the number 7."""
    spec = WorldSpec.model_validate({"simscen": 1, "name": "0o7", "places": {"on": {"x": 0, "y": 0}}})
    tree, problems = parse_yaml(world_text(spec), "world")
    assert not problems
    assert tree is not None and WorldSpec.model_validate(tree.plain) == spec


def test_yaml_is_quoted_only_if_necessary() -> None:
    """Values are quoted only if necessary."""
    data = {"name": "lidar dropout", "when": {"time": 10.5}, "goals": ["1e3", "on"], "yaw": "90 deg"}
    text = to_yaml(data)
    assert text == "name: lidar dropout\nwhen:\n  time: 10.5\ngoals:\n- '1e3'\n- on\nyaw: 90 deg\n"
    assert yaml.safe_load(text)["goals"][1] is True  # in YAML 1.1
