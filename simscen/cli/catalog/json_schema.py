"""JSON Schemas of simscen's YAML files, which editors use for completion, hover texts, and errors.

A Choice is a model of a mapping with exactly one main key, such as the kind of a trigger, and optional modifiers.
"""

import json
from typing import Any, get_args

from pydantic import BaseModel, RootModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from simscen.cli.catalog.schema_simplification import Schema, join_descriptions, simplify_for_editors
from simscen.loading.stacks.choice import SCENARIO_KEYS
from simscen.loading.yaml.library import APPEND_SUFFIX
from simscen.model.robot import RobotSpec
from simscen.model.scenario import ScenarioSpec
from simscen.model.stack_files import StackFileSpec, UserConfigSpec
from simscen.model.world import WorldSpec
from simscen.spec.choice import Choice, with_installed_choices
from simscen.spec.extensible_union import GROUP_KEY, MAPPINGS_ALLOWED_KEY, NAMES_ALLOWED_KEY
from simscen.spec.registry import installed_specs

MODELS: dict[str, type[BaseModel]] = {
    "scenario": ScenarioSpec,
    "world": WorldSpec,
    "robot": RobotSpec,
    "stack": StackFileSpec,
    "config": UserConfigSpec,
    "base": ScenarioSpec,
}
"""Pydantic model of each kind of file. A base file is an incomplete scenario that scenarios extend."""
DRAFT = "http://json-schema.org/draft-07/schema#"
"""Identifier of the version of JSON Schema."""


def schema_of(name: str, with_plugins: bool = False) -> Schema:
    """Return the JSON Schema of a kind of file, a key of MODELS. `with_plugins` adds types of installed packages."""
    model = MODELS[name]
    generated = model.model_json_schema(schema_generator=_InstalledTypesGenerator if with_plugins else _Generator)
    definitions = generated.get("$defs", {})
    if name == "stack":
        for definition in definitions.values():
            for key in SCENARIO_KEYS:
                definition.get("properties", {}).pop(key, None)
    if name == "scenario":
        definitions[WorldSpec.__name__].pop("required")  # an inline world needs no `simscen`
    if name == "base":
        _make_extensible_keys_optional(generated, definitions)
    properties = {"extends": _EXTENDS, **generated["properties"]}
    if model is ScenarioSpec:
        for key, value in generated["properties"].items():
            if value.get("type") == "array":
                description = f"Entries that are appended to `{key}` of the extended file."
                properties[f"{key}{APPEND_SUFFIX}"] = {**value, "description": description}
    schema = simplify_for_editors({**generated, "properties": properties}, definitions)
    # Other required keys may come from the extended file or from a defaults.yaml in the same folder.
    required = ["simscen"] if model.model_fields["simscen"].is_required() and name != "base" else []
    return {"$schema": DRAFT, "title": f"simscen {name}", **schema, "required": required}


def _make_extensible_keys_optional(generated: Schema, definitions: Schema) -> None:
    """Make required keys optional, except in lists, because the file that extends a base file can add them."""
    in_lists = _referenced_definitions(generated, definitions, in_lists=True)
    for name in _referenced_definitions(generated, definitions, in_lists=False) - in_lists:
        definitions[name].pop("required", None)


def _referenced_definitions(schema: Schema, definitions: Schema, *, in_lists: bool) -> set[str]:
    """Return the names of the definitions to which a schema refers within lists (`in_lists`) or outside of lists."""
    found: set[str] = set()
    visited: set[tuple[str, bool]] = set()

    def walk(node: Any, in_list: bool) -> None:
        if isinstance(node, list):
            for item in node:
                walk(item, in_list)
        if not isinstance(node, dict):
            return
        name = str(node.get("$ref", "")).rpartition("/")[2]
        if name and (name, in_list) not in visited:
            visited.add((name, in_list))
            if in_list == in_lists:
                found.add(name)
            walk(definitions[name], in_list)
        for key, value in node.items():
            if key != "$defs":
                walk(value, in_list or key in ("items", "prefixItems"))

    walk(schema, False)
    return found


def as_text(schema: Schema) -> str:
    """Return the text of a schema file."""
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


_EXTENDS: Schema = {
    "type": "string",
    "description": "File of the same kind, relative to this file; its keys apply unless this file sets them.",
}


class _Generator(GenerateJsonSchema):
    """Schema generator that requires exactly one main key of a Choice, and describes the values of root models.

    The generator adds simscen's types that are registered as entry points.
    """

    with_plugins = False
    """Whether to add the types of other packages, too."""

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        result, model = super().model_schema(schema), schema["cls"]
        if issubclass(model, RootModel) and model.__doc__:
            result["description"] = join_descriptions(model.__doc__.strip(), result.get("description", ""))
        if issubclass(model, Choice):
            has_more = self.with_plugins and with_installed_choices(model) is not model
            added = installed_specs(model.group) if has_more else {}
            for key, choice in added.items():
                nullable = core_schema.nullable_schema(choice.__pydantic_core_schema__)
                result["properties"][key] = self.generate_inner(nullable)
            result.update(_require_one_key(model, [*model.choices(), *added]))
        return result

    def function_wrap_schema(self, schema: core_schema.WrapValidatorFunctionSchema) -> JsonSchemaValue:
        result, metadata = super().function_wrap_schema(schema), schema.get("metadata", {})
        if GROUP_KEY not in metadata:
            return result
        models = installed_specs(metadata[GROUP_KEY], self.with_plugins)
        names = list(models) if metadata[NAMES_ALLOWED_KEY] else []
        members: list[Schema] = []
        others: list[Schema] = []
        for name, model in models.items() if metadata[MAPPINGS_ALLOWED_KEY] else ():
            model.model_rebuild()
            member = self.generate_inner(model.__pydantic_core_schema__)
            if get_args(model.model_fields["type"].annotation) == (name,):
                members.append(member)
            else:
                others.append({"allOf": [member, {"properties": {"type": {"const": name}}, "required": ["type"]}]})
        extended = _with_options(result, names, members)
        return {"anyOf": [extended, *others]} if others else extended


class _InstalledTypesGenerator(_Generator):
    """Schema generator that also adds the types of installed packages."""

    with_plugins = True


def _with_options(union: Schema, names: list[str], mappings: list[Schema]) -> Schema:
    """Return the schema `union` with further options: the strings `names`, and the references `mappings`.

    A union is an `enum` of names, a `oneOf` of references to schemas of mappings, or a `oneOf` of both.
    """
    if "enum" in union:
        return {**union, "enum": [*union["enum"], *names]}
    if all("$ref" in option for option in union["oneOf"]):
        options = [*union["oneOf"], *mappings]
        return {"oneOf": options} if len(options) > 1 else options[0]
    return {"oneOf": [_with_options(option, names, mappings) for option in union["oneOf"]]}


def _require_one_key(model: type[Choice], keys: list[str]) -> Schema:
    """Return the part of a Choice's schema that rejects a mapping with several of `keys`, or with none of them.

    If a mapping has no key except modifiers, editors show "expected one of: …".
    """
    # With `maxProperties`, yaml-language-server would count the key that is being typed, and offer no completions.
    present: list[Schema] = [{"type": "object", "required": [key]} for key in keys]
    modifiers = [field.alias or name for name, field in model.model_fields.items() if name in model.modifiers]
    missing = {"type": "string", "errorMessage": f"expected one of: {', '.join(keys)}"}
    return {
        "oneOf": [*present, {"not": {"anyOf": present}}],
        "if": {"type": "object", "propertyNames": {"enum": modifiers}},
        "then": missing,
    }
