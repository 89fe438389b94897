"""Tests of the JSON schemas, and of `simscen schema`."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from simscen.cli.catalog.generate import ROOT, outdated_files
from simscen.cli.catalog.json_schema import MODELS, schema_of
from simscen.loading.yaml.parser import parse_yaml

DIAGNOSTICS = ROOT / "tests/diagnostics"
SHIPPED = {
    "scenario": sorted(ROOT.glob("scenarios/**/*.scenario.yaml")),
    "world": sorted(ROOT.glob("worlds/**/*.world.yaml")),
    "robot": sorted(ROOT.glob("simscen/data/robots/*.robot.yaml")),
}
SCHEMA_ERRORS = [
    "five_mistakes", "typo_in_a_key", "key_far_from_all", "wrong_types", "units", "choices", "empty_values", "names",
    "single_key_choices", "another_version", "misspelled_instead_of_missing",
]  # fmt: skip


def test_generated_files_are_up_to_date() -> None:
    assert outdated_files() == [], "run `make docs`"


def _load_yaml(text: str) -> Any:
    """Return the YAML as simscen and editors read it, because the loader of PyYAML reads the key `off` as false."""
    tree, _ = parse_yaml(text, "f")
    return tree and tree.plain


@pytest.mark.parametrize("kind", MODELS)
def test_schemas_are_valid(kind: str) -> None:
    jsonschema.Draft7Validator.check_schema(schema_of(kind))


@pytest.mark.parametrize("kind", SHIPPED)
def test_shipped_files_match_their_schema(kind: str) -> None:
    validator = jsonschema.Draft7Validator(schema_of(kind))
    for file in SHIPPED[kind]:
        errors = [error.message for error in validator.iter_errors(_load_yaml(file.read_text()))]
        assert not errors, file


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", SCHEMA_ERRORS)
def test_invalid_files_do_not_match_their_schema(name: str) -> None:
    validator = jsonschema.Draft7Validator(schema_of("scenario"))
    assert not validator.is_valid(_load_yaml((DIAGNOSTICS / f"{name}.scenario.yaml").read_text()))


def _errors(text: str) -> list[str]:
    errors = jsonschema.Draft7Validator(schema_of("scenario")).iter_errors(_load_yaml(text))
    return [f"{'.'.join(map(str, error.absolute_path))}: {error.message}" for error in errors]


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("text", "expected_text"),
    [
        ("simscen: 1\nseeed: 7", ": Additional properties are not allowed ('seeed' was unexpected)"),
        ("simscen: 1\nstack: {controller: {type: dwb, gamma: 1}}", "stack.controller: Additional properties"),
        ("simscen: 1\nstack: {external: mine, planner: {}}", "stack: Additional properties are not allowed ('planner'"),
        ("simscen: 1\nstack: {external: 7}", "stack.external: 7 is not of type 'string'"),
        ("simscen: 1\nstack: {localizer: {alpha1: x}}", "stack.localizer.alpha1: 'x' is not of type 'number'"),
        ("simscen: 1\nrobot: {pose: {x: 1}}", "robot.pose: 'y' is a required property"),
        ("simscen: 1\nevents: [{when: {time: 1}, do: {spwan: {}}}]", "events.0.do: Additional properties"),
        ("simscen: 1\nevents: [{when: {time: 1}, do: [{remove: {nam: x}}]}]", "events.0.do.0.remove: Additional"),
    ],
)
def test_one_mistake_gives_one_error_at_its_location(text: str, expected_text: str) -> None:
    assert any(error.startswith(expected_text) for error in _errors(text)), _errors(text)


def test_every_key_has_a_hover_text() -> None:
    """All parts of a scenario have a hover text; parameters of the stack have the names of Nav2."""
    definitions = schema_of("scenario")["$defs"]
    for name in ("GoalEntry", "EventEntry", "FaultEntry", "Spawn", "StoppedWithin", "Wall"):
        for key, schema in definitions[name]["properties"].items():
            assert schema.get("description") or "$ref" in schema, f"{name}.{key}"


def _mappings_in(node: Any) -> list[dict[str, Any]]:
    if isinstance(node, dict):
        return [node, *(inner for value in node.values() for inner in _mappings_in(value))]
    return [inner for item in node for inner in _mappings_in(item)] if isinstance(node, list) else []


def test_schema_has_no_nulls_and_no_large_defaults() -> None:
    for node in _mappings_in(schema_of("scenario")):
        assert node.get("type") != "null"
        assert not isinstance(node.get("default"), dict)


def test_command_writes_the_committed_schemas(simscen, tmp_path: Path) -> None:
    assert simscen("schema", "--write", "written").code == 0
    for kind in MODELS:
        written = (tmp_path / f"written/{kind}.schema.json").read_text()
        assert written == (ROOT / f"schemas/{kind}.schema.json").read_text()
    assert json.loads(simscen("schema", "world").out) == schema_of("world")


def test_check_jsonschema_agrees() -> None:
    """Run the tool of the pre-commit hooks on a valid and an invalid file."""
    schema = str(ROOT / "schemas/scenario.schema.json")
    for file, is_valid in ((SHIPPED["scenario"][0], True), (DIAGNOSTICS / "five_mistakes.scenario.yaml", False)):
        command = [sys.executable, "-m", "check_jsonschema", "--schemafile", schema, str(file)]
        result = subprocess.run(command, check=False, capture_output=True, text=True)
        assert (result.returncode == 0) == is_valid, result.stdout


BASES = [
    ({}, True),
    ({"tags": ["smoke"], "pass+": [{"collisions": {"max": 0}}]}, True),
    ({"robot": {"model": "amr"}, "extends": "b.base.yaml"}, True),
    ({"gaols": []}, False),
    ({"goals": [{"timeout": "3 s"}]}, False),
    ({"robot": {"modle": "amr"}}, False),
    ({"pass+": [{"colisions": {}}]}, False),
]


@pytest.mark.sample(3)
@pytest.mark.parametrize(("base", "is_valid"), BASES)
def test_base_file_matches_the_base_schema(base: dict[str, Any], is_valid: bool) -> None:
    assert jsonschema.Draft7Validator(schema_of("base")).is_valid(base) is is_valid
