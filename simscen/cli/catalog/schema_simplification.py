"""Simplification of a generated JSON Schema for editors.

Editors then show short texts, and only the errors of the alternative that the file uses.
"""

from typing import Any

Schema = dict[str, Any]


def simplify_for_editors(node: Any, definitions: Schema) -> Any:
    """Return a schema for editors: with if/then instead of unions; without null, titles, and long defaults."""
    if isinstance(node, list):
        return [simplify_for_editors(item, definitions) for item in node]
    if not isinstance(node, dict):
        return node
    node = _without_noise(_without_null(node))
    node = _select_by_json_type(_select_by_type(node, definitions))
    return {
        # The keys below these are names, not keywords: a property may be named `title`.
        key: {name: simplify_for_editors(schema, definitions) for name, schema in value.items()}
        if key in ("properties", "$defs")
        else simplify_for_editors(value, definitions)
        for key, value in node.items()
    }


def _select_by_type(node: Schema, definitions: Schema) -> Schema:
    """Return a union that is discriminated by `type` as if/then, so that editors show only the selected member."""
    members = {
        ref["$ref"]: definitions[ref["$ref"].rpartition("/")[2]] for ref in node.get("oneOf", []) if "$ref" in ref
    }
    types = {ref: member["properties"].get("type", {}).get("const") for ref, member in members.items()}
    untyped = {ref: members[ref].get("required", []) for ref, kind in types.items() if kind is None}
    if len(members) < 2 or any(len(required) != 1 for required in untyped.values()):
        return node
    if untyped:
        return _select_by_key(node, {ref: required[0] for ref, required in untyped.items()}, definitions)
    other_keywords = {key: value for key, value in node.items() if key not in ("oneOf", "discriminator")}
    cases = []
    for index, (ref, kind) in enumerate(types.items()):
        condition: Schema = {"properties": {"type": {"const": kind}}}
        if index > 0 or "type" in members[ref].get("required", []):  # the first member can be the default
            condition["required"] = ["type"]
        cases.append({"if": condition, "then": {"$ref": ref}})
    type_required = {"required": ["type"]} if all("required" in case["if"] for case in cases) else {}
    properties = {"type": {"enum": list(types.values())}}
    return {**other_keywords, "type": "object", "properties": properties, **type_required, "allOf": cases}


def _select_by_key(node: Schema, keys: dict[str, str], definitions: Schema) -> Schema:
    """Return a union as if/then. Members without `type` are selected by their only required key.

    `keys` has the required key of each member without `type`, by the reference of the member.
    """
    other_keywords = {key: value for key, value in node.items() if key not in ("oneOf", "discriminator")}
    others = [option for option in node["oneOf"] if option.get("$ref") not in keys]
    schema = others[0] if len(others) == 1 else _select_by_type({"oneOf": others}, definitions)
    for ref, key in keys.items():
        schema = {"if": {"type": "object", "required": [key]}, "then": {"$ref": ref}, "else": schema}
    return {**other_keywords, **schema}


def _select_by_json_type(node: Schema) -> Schema:
    """Return a union of two JSON types, such as text and mapping, as if/then.

    Errors then refer to the alternative with the type of the value.
    """
    options = node.get("oneOf", [])
    plain = [option for option in options if option.get("type") in ("string", "array")]
    if len(options) != 2 or not plain or options[0].get("type") == options[1].get("type"):
        return node
    other = next(option for option in options if option is not plain[0])
    other_keywords = {key: value for key, value in node.items() if key != "oneOf"}
    values = plain[0].get("enum", plain[0].get("examples", []))
    offered = {"examples": values} if values else {}  # an editor uses neither branch for an empty value
    return {**other_keywords, **offered, "if": {"type": plain[0]["type"]}, "then": plain[0], "else": other}


def _without_null(node: Schema) -> Schema:
    """Return the schema of an optional value without the alternative null."""
    options = node.get("anyOf", [])
    if {"type": "null"} not in options:
        return node
    others = [option for option in options if option != {"type": "null"}]
    outer = {key: value for key, value in node.items() if key not in ("anyOf", "default")}
    inner: Schema = others[0] if len(others) == 1 else {"anyOf": others}
    texts = join_descriptions(outer.get("description", ""), inner.get("description", ""))
    return {**inner, **outer, **({"description": texts} if texts else {})}


def _without_noise(node: Schema) -> Schema:
    """Return the schema without its title, and without a default that is null, a mapping, or a list."""
    omits_default = isinstance(node.get("default"), dict | list) or node.get("default", 0) is None
    return {key: value for key, value in node.items() if key != "title" and not (key == "default" and omits_default)}


def join_descriptions(text: str, more: str) -> str:
    """Return a description, followed by a second one in parentheses if both differ."""
    if text and more and text != more:
        return f"{text}\n\n({more})"
    return text or more
