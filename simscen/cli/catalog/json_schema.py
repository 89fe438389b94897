"""JSON Schemas of simscen's YAML files, which editors use for completion, hover texts, and errors.

A Choice is a model of a mapping with exactly one main key, such as the kind of a trigger, and optional modifiers.
"""

import json
from typing import Any, get_args

from pydantic import BaseModel, RootModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from simscen.loading.stacks.choice import SCENARIO_KEYS
from simscen.loading.yaml.library import APPEND_SUFFIX
from simscen.model.robot import RobotSpec
from simscen.model.scenario import ScenarioSpec
from simscen.model.stack_files import StackFileSpec, UserConfigSpec
from simscen.model.world import WorldSpec
from simscen.spec.choice import Choice, with_installed_choices
from simscen.spec.extensible_union import GROUP_KEY, MAPPINGS_ALLOWED_KEY, NAMES_ALLOWED_KEY
from simscen.spec.registry import installed_specs

Schema = dict[str, Any]

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


def schema_of(name: str, installed: bool = False) -> Schema:
    """Return the JSON Schema of a kind of file (a key of MODELS). `installed` adds the types of installed packages."""
    model = MODELS[name]
    generated = model.model_json_schema(schema_generator=_InstalledTypesGenerator if installed else _Generator)
    if name == "stack":
        _remove_scenario_keys(generated)
    if name == "base":
        _make_extensible_keys_optional(generated)
    properties = {
        "extends": _EXTENDS,
        **generated["properties"],
        **(_append_keys(generated) if model is ScenarioSpec else {}),
    }
    schema = _simplify({**generated, "properties": properties}, generated.get("$defs", {}))
    # Other required keys may come from the extended file or from a defaults.yaml in the same folder.
    needed = ["simscen"] if model.model_fields["simscen"].is_required() and name != "base" else []
    return {"$schema": DRAFT, "title": f"simscen {name}", **schema, "required": needed}


def _remove_scenario_keys(generated: Schema) -> None:
    """Remove SCENARIO_KEYS, the keys that only a scenario may set, from the schema of a stack file."""
    for definition in generated["$defs"].values():
        for key in SCENARIO_KEYS:
            definition.get("properties", {}).pop(key, None)


def _append_keys(generated: Schema) -> Schema:
    """Return the schemas of the keys that append to a list of the extended file, such as `pass+`."""
    lists = {name: value for name, value in generated["properties"].items() if value.get("type") == "array"}
    return {
        f"{name}{APPEND_SUFFIX}": {
            **value,
            "description": f"Entries that are appended to `{name}` of the extended file.",
        }
        for name, value in lists.items()
    }


def _make_extensible_keys_optional(generated: Schema) -> None:
    """Make required keys optional, except in lists, because the file that extends a base file can add them."""
    definitions = generated.get("$defs", {})
    in_lists = _referenced_definitions(generated, definitions, in_lists=True)
    for name in _referenced_definitions(generated, definitions, in_lists=False) - in_lists:
        definitions[name].pop("required", None)


def _referenced_definitions(schema: Schema, definitions: Schema, *, in_lists: bool) -> set[str]:
    """Return the names of the definitions to which a schema refers within lists (`in_lists`) or outside of lists."""
    found: set[str] = set()
    seen: set[tuple[str, bool]] = set()

    def walk(node: Any, in_list: bool) -> None:
        if isinstance(node, list):
            for item in node:
                walk(item, in_list)
        if not isinstance(node, dict):
            return
        name = str(node.get("$ref", "")).rpartition("/")[2]
        if name and (name, in_list) not in seen:
            seen.add((name, in_list))
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
    """Schema generator that also requires exactly one main key of a Choice, and describes models of single values.

    It adds simscen's types that are registered as entry points.
    """

    with_plugins = False
    """Whether to add the types of other packages, too."""

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        result, model = super().model_schema(schema), schema["cls"]
        if issubclass(model, RootModel) and model.__doc__:
            result["description"] = _join_descriptions(model.__doc__.strip(), result.get("description", ""))
        if issubclass(model, Choice):
            result.update(_exactly_one(model, list(model.choices())))
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
        extended = _extend_union(result, names, members)
        return {"anyOf": [extended, *others]} if others else extended


class _InstalledTypesGenerator(_Generator):
    """Schema generator that also adds the types of installed packages."""

    with_plugins = True

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        result, model = super().model_schema(schema), schema["cls"]
        if not issubclass(model, Choice) or with_installed_choices(model) is model:
            return result
        added = installed_specs(model.group)
        for key, choice in added.items():
            result["properties"][key] = self.generate_inner(
                core_schema.nullable_schema(choice.__pydantic_core_schema__)
            )
        return {**result, **_exactly_one(model, [*model.choices(), *added])}


def _extend_union(union: Schema, names: list[str], members: list[Schema]) -> Schema:
    """Return the schema of a union of names and mappings with further names and further references to mappings."""
    if "enum" in union:
        return {**union, "enum": [*union["enum"], *names]}
    options = union.get("oneOf", [union])
    if all("$ref" in option for option in options):
        rest = union if "oneOf" in union else {}
        return {**rest, "oneOf": [*options, *members]} if members else union
    return {**union, "oneOf": [_extend_union(option, names, members) for option in options]}


def _exactly_one(model: type[Choice], keys: list[str]) -> Schema:
    """Return a schema that requires exactly one of `keys`.

    For a mapping with only modifiers of the model, editors show "expected one of: …".
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


def _simplify(node: Any, definitions: Schema) -> Any:
    """Return an equivalent schema for editors: unions as if/then, no nulls, titles, and defaults that are mappings."""
    if isinstance(node, list):
        return [_simplify(item, definitions) for item in node]
    if not isinstance(node, dict):
        return node
    node = _without_noise(_without_null(node))
    node = _by_json_type(_by_type(node, definitions))
    return {
        # The keys below these are names, not keywords: a property may be named `title`.
        key: {name: _simplify(schema, definitions) for name, schema in value.items()}
        if key in ("properties", "$defs")
        else _simplify(value, definitions)
        for key, value in node.items()
    }


def _by_type(node: Schema, definitions: Schema) -> Schema:
    """Return a union that is discriminated by `type` as if/then, so that editors show only the selected member."""
    members = {
        ref["$ref"]: definitions[ref["$ref"].rpartition("/")[2]] for ref in node.get("oneOf", []) if "$ref" in ref
    }
    types = {ref: member["properties"].get("type", {}).get("const") for ref, member in members.items()}
    untyped = {ref: members[ref].get("required", []) for ref, kind in types.items() if kind is None}
    if len(members) < 2 or any(len(required) != 1 for required in untyped.values()):
        return node
    if untyped:
        return _by_key(node, {ref: required[0] for ref, required in untyped.items()}, definitions)
    rest = {key: value for key, value in node.items() if key not in ("oneOf", "discriminator")}
    cases = []
    for index, (ref, kind) in enumerate(types.items()):
        condition: Schema = {"properties": {"type": {"const": kind}}}
        if index > 0 or "type" in members[ref].get("required", []):  # the first one can be the default
            condition["required"] = ["type"]
        cases.append({"if": condition, "then": {"$ref": ref}})
    needed = {"required": ["type"]} if all("required" in case["if"] for case in cases) else {}
    return {**rest, "type": "object", "properties": {"type": {"enum": list(types.values())}}, **needed, "allOf": cases}


def _by_key(node: Schema, keys: dict[str, str], definitions: Schema) -> Schema:
    """Return a union as if/then. Members without `type` are selected by their only required key.

    `keys` maps the reference of each such member to this key.
    """
    rest = {key: value for key, value in node.items() if key not in ("oneOf", "discriminator")}
    others = [option for option in node["oneOf"] if option.get("$ref") not in keys]
    schema = others[0] if len(others) == 1 else _by_type({"oneOf": others}, definitions)
    for ref, key in keys.items():
        schema = {"if": {"type": "object", "required": [key]}, "then": {"$ref": ref}, "else": schema}
    return {**rest, **schema}


def _by_json_type(node: Schema) -> Schema:
    """Return a union of two JSON types, such as text and mapping, as if/then, so that errors refer to the type used."""
    options = node.get("oneOf", [])
    plain = [option for option in options if option.get("type") in ("string", "array")]
    if len(options) != 2 or not plain or options[0].get("type") == options[1].get("type"):
        return node
    other = next(option for option in options if option is not plain[0])
    rest = {key: value for key, value in node.items() if key != "oneOf"}
    values = plain[0].get("enum", plain[0].get("examples", []))
    offered = {"examples": values} if values else {}  # an editor uses neither branch for an empty value
    return {**rest, **offered, "if": {"type": plain[0]["type"]}, "then": plain[0], "else": other}


def _without_null(node: Schema) -> Schema:
    """Return the schema of an optional value without the alternative null."""
    options = node.get("anyOf", [])
    if {"type": "null"} not in options:
        return node
    rest = [option for option in options if option != {"type": "null"}]
    outer = {key: value for key, value in node.items() if key not in ("anyOf", "default")}
    inner: Schema = rest[0] if len(rest) == 1 else {"anyOf": rest}
    texts = _join_descriptions(outer.get("description", ""), inner.get("description", ""))
    return {**inner, **outer, **({"description": texts} if texts else {})}


def _without_noise(node: Schema) -> Schema:
    """Return the schema without its title, and without a default that is null, a mapping, or a list."""
    bulky = isinstance(node.get("default"), dict | list) or node.get("default", 0) is None
    return {key: value for key, value in node.items() if key != "title" and not (key == "default" and bulky)}


def _join_descriptions(text: str, more: str) -> str:
    """Return a description, followed by a second one in parentheses if both differ."""
    if text and more and text != more:
        return f"{text}\n\n({more})"
    return text or more
