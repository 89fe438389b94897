"""JSON Schemas of the language, shaped for editors: completion, hover texts, and errors that name the mistake."""

import json
from typing import Any

from pydantic import BaseModel, RootModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from simscen.loading.stacks.choice import SCENARIO_KEYS
from simscen.loading.yaml.library import APPEND_SUFFIX
from simscen.model.robot import RobotSpec
from simscen.model.scenario import ScenarioSpec
from simscen.model.stack_files import StackFileSpec, UserConfigSpec
from simscen.model.world import WorldSpec
from simscen.spec import extensible_union
from simscen.spec.choice import Choice, installed_choices, with_installed_choices
from simscen.spec.extensible_union import GROUP_KEY, MAPPINGS_ALLOWED_KEY, NAMES_ALLOWED_KEY

Schema = dict[str, Any]

MODELS: dict[str, type[BaseModel]] = {
    "scenario": ScenarioSpec,
    "world": WorldSpec,
    "robot": RobotSpec,
    "stack": StackFileSpec,
    "config": UserConfigSpec,
    "base": ScenarioSpec,
}
DRAFT = "http://json-schema.org/draft-07/schema#"
"""What yaml-language-server knows best; nothing newer is needed."""


def schema_of(name: str, installed: bool = False) -> Schema:
    """The JSON Schema of a kind of file, e.g. "scenario"; of what is `installed`, too, if asked."""
    model = MODELS[name]
    generated = model.model_json_schema(schema_generator=_WithInstalled if installed else _Generator)
    if name == "stack":
        _leave_to_the_scenario(generated)
    if name == "base":
        _leave_to_those_that_extend(generated)
    known = {"extends": _EXTENDS, **generated["properties"], **(_added(generated) if model is ScenarioSpec else {})}
    schema = _mended({**generated, "properties": known}, generated.get("$defs", {}))
    # Any other key may come from the file it extends or from the defaults.yaml beside it.
    needed = ["simscen"] if model.model_fields["simscen"].is_required() and name != "base" else []
    return {"$schema": DRAFT, "title": f"simscen {name}", **schema, "required": needed}


def _leave_to_the_scenario(generated: Schema) -> None:
    """What a stack file may not say of a stack."""
    for definition in generated["$defs"].values():
        for key in SCENARIO_KEYS:
            definition.get("properties", {}).pop(key, None)


def _added(generated: Schema) -> Schema:
    """`pass+` and the like: what is added to the list of the file that is extended."""
    lists = {name: told for name, told in generated["properties"].items() if told.get("type") == "array"}
    return {
        f"{name}{APPEND_SUFFIX}": {**told, "description": f"Added to `{name}` of the file that is extended."}
        for name, told in lists.items()
    }


def _leave_to_those_that_extend(generated: Schema) -> None:
    """What extends a base can add keys to its mappings, but nothing to what stands in its lists."""
    definitions = generated.get("$defs", {})
    in_lists = _reached(generated, definitions, lists=True)
    for name in _reached(generated, definitions, lists=False) - in_lists:
        definitions[name].pop("required", None)


def _reached(schema: Schema, definitions: Schema, lists: bool) -> set[str]:
    """The definitions that a schema leads to without passing a list; or with `lists`, behind one."""
    found: set[str] = set()
    seen: set[tuple[str, bool]] = set()

    def walk(node: Any, behind: bool) -> None:
        if isinstance(node, list):
            for item in node:
                walk(item, behind)
        if not isinstance(node, dict):
            return
        name = str(node.get("$ref", "")).rpartition("/")[2]
        if name and (name, behind) not in seen:
            seen.add((name, behind))
            if behind == lists:
                found.add(name)
            walk(definitions[name], behind)
        for key, value in node.items():
            if key != "$defs":
                walk(value, behind or key in ("items", "prefixItems"))

    walk(schema, False)
    return found


def as_text(schema: Schema) -> str:
    """As it is written to a file."""
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


_EXTENDS: Schema = {
    "type": "string",
    "description": "A file of the same kind, relative to this one: its keys hold where this file does not give them.",
}


class _Generator(GenerateJsonSchema):
    """Pydantic's generator with what it cannot know: single-key choices, and the docstrings of bare values."""

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        made, model = super().model_schema(schema), schema["cls"]
        if issubclass(model, RootModel) and model.__doc__:
            made["description"] = _joined(model.__doc__.strip(), made.get("description", ""))
        if issubclass(model, Choice):
            made.update(_exactly_one(model, list(model.choices())))
        return made


class _WithInstalled(_Generator):
    """The same, with the choices that installed packages add; broken ones are left out, as nobody can write them."""

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        made, model = super().model_schema(schema), schema["cls"]
        if not issubclass(model, Choice) or with_installed_choices(model) is model:
            return made
        for key, found in installed_choices(model).items():
            made["properties"][key] = self.generate_inner(core_schema.nullable_schema(found.__pydantic_core_schema__))
        return {**made, **_exactly_one(model, [*model.choices(), *installed_choices(model)])}

    def function_wrap_schema(self, schema: core_schema.WrapValidatorFunctionSchema) -> JsonSchemaValue:
        made, told = super().function_wrap_schema(schema), schema.get("metadata", {})
        models = dict(extensible_union.installed_specs(told[GROUP_KEY])) if GROUP_KEY in told else {}
        more: list[Schema] = [self._named(name, model) for name, model in models.items() if told[MAPPINGS_ALLOWED_KEY]]
        if models and told[NAMES_ALLOWED_KEY]:
            more.append({"enum": list(models)})
        return {"anyOf": [made, *more]} if more else made

    def _named(self, name: str, model: type[BaseModel]) -> JsonSchemaValue:
        """The schema of a specification that is chosen by the name of its entry point."""
        typed: Schema = {"properties": {"type": {"const": name}}, "required": ["type"]}
        model.model_rebuild()
        return {"allOf": [self.generate_inner(model.__pydantic_core_schema__), typed]}


def _exactly_one(model: type[Choice], keys: list[str]) -> Schema:
    """One of `keys`, and only one; where there is none, a misspelled one is told about by what does not know it.

    With `maxProperties` yaml-language-server would offer nothing: it counts the key that is being typed.
    """
    given: list[Schema] = [{"type": "object", "required": [key]} for key in keys]
    beside = [field.alias or name for name, field in model.model_fields.items() if name in model.modifiers]
    missing = {"type": "string", "errorMessage": f"expected one of: {', '.join(keys)}"}
    return {
        "oneOf": [*given, {"not": {"anyOf": given}}],
        "if": {"type": "object", "propertyNames": {"enum": beside}},
        "then": missing,
    }


def _mended(node: Any, definitions: Schema) -> Any:
    """A schema without titles, nulls and bulky defaults, its unions told apart by `type` as if/then."""
    if isinstance(node, list):
        return [_mended(item, definitions) for item in node]
    if not isinstance(node, dict):
        return node
    node = _without_noise(_without_null(node))
    node = _by_json_type(_by_type(node, definitions))
    return {
        # Under these are names, not keywords: a property may be called `title`.
        key: {name: _mended(schema, definitions) for name, schema in value.items()}
        if key in ("properties", "$defs")
        else _mended(value, definitions)
        for key, value in node.items()
    }


def _by_type(node: Schema, definitions: Schema) -> Schema:
    """A union told apart by `type`: an editor then completes and checks the one that is meant, not all of them."""
    members = {
        ref["$ref"]: definitions[ref["$ref"].rpartition("/")[2]] for ref in node.get("oneOf", []) if "$ref" in ref
    }
    types = {ref: member["properties"].get("type", {}).get("const") for ref, member in members.items()}
    apart = {ref: members[ref].get("required", []) for ref, kind in types.items() if kind is None}
    if len(members) < 2 or any(len(required) != 1 for required in apart.values()):
        return node
    if apart:
        return _by_key(node, {ref: required[0] for ref, required in apart.items()}, definitions)
    rest = {key: value for key, value in node.items() if key not in ("oneOf", "discriminator")}
    cases = []
    for ref, kind in types.items():
        condition: Schema = {"properties": {"type": {"const": kind}}}
        if "type" in members[ref].get("required", []):
            condition["required"] = ["type"]
        cases.append({"if": condition, "then": {"$ref": ref}})
    needed = {"required": ["type"]} if all("required" in case["if"] for case in cases) else {}
    return {**rest, "type": "object", "properties": {"type": {"enum": list(types.values())}}, **needed, "allOf": cases}


def _by_key(node: Schema, apart: dict[str, str], definitions: Schema) -> Schema:
    """A union some members of which have no `type`: each is known by the one key that it requires."""
    rest = {key: value for key, value in node.items() if key not in ("oneOf", "discriminator")}
    others = [option for option in node["oneOf"] if option.get("$ref") not in apart]
    made = others[0] if len(others) == 1 else _by_type({"oneOf": others}, definitions)
    for ref, key in apart.items():
        made = {"if": {"type": "object", "required": [key]}, "then": {"$ref": ref}, "else": made}
    return {**rest, **made}


def _by_json_type(node: Schema) -> Schema:
    """A text or a mapping, one or a list: the mistake is told about the one that was written."""
    options = node.get("oneOf", [])
    plain = [option for option in options if option.get("type") in ("string", "array")]
    if len(options) != 2 or not plain or options[0].get("type") == options[1].get("type"):
        return node
    other = next(option for option in options if option is not plain[0])
    rest = {key: value for key, value in node.items() if key != "oneOf"}
    words = plain[0].get("enum", plain[0].get("examples", []))
    offered = {"examples": words} if words else {}  # where nothing is written yet, an editor looks at neither branch
    return {**rest, **offered, "if": {"type": plain[0]["type"]}, "then": plain[0], "else": other}


def _without_null(node: Schema) -> Schema:
    """An optional key is left out, never null."""
    options = node.get("anyOf", [])
    if {"type": "null"} not in options:
        return node
    rest = [option for option in options if option != {"type": "null"}]
    outer = {key: value for key, value in node.items() if key not in ("anyOf", "default")}
    inner: Schema = rest[0] if len(rest) == 1 else {"anyOf": rest}
    texts = _joined(outer.get("description", ""), inner.get("description", ""))
    return {**inner, **outer, **({"description": texts} if texts else {})}


def _without_noise(node: Schema) -> Schema:
    bulky = isinstance(node.get("default"), dict | list) or node.get("default", 0) is None
    return {key: value for key, value in node.items() if key != "title" and not (key == "default" and bulky)}


def _joined(text: str, more: str) -> str:
    if text and more and text != more:
        return f"{text}\n\n({more})"
    return text or more
