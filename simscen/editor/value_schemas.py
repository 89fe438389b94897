"""Lookup of the JSON Schema of single values of a file, for forms and for the order of keys.

`data` is the content of the file as dicts, lists, and scalars. `keys` are the path to a value: keys of mappings and
indices of lists.
"""

import json
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

from simscen.core.version import PACKAGE
from simscen.loading.yaml.tree import Key

Schema = dict[str, Any]
MAX_REFERENCES = 8
"""Maximum number of references and conditions that are resolved for one value."""
_TYPES: dict[str, type | tuple[type, ...]] = {
    "string": str,
    "array": list,
    "object": dict,
    "boolean": bool,
    "integer": int,
    "number": (int, float),
    "null": type(None),
}
"""Python types by JSON type."""


@cache
def schema_of_kind(kind: str) -> Schema:
    """Return the JSON Schema of a kind of file: "scenario" or "world"."""
    schema: Schema = json.loads((PACKAGE / "data" / "schemas" / f"{kind}.schema.json").read_text(encoding="utf-8"))
    return schema


def schema_at(root: Schema, keys: Sequence[Key], data: Any) -> Schema:
    """Return the schema of the value at `keys`; {} for an unknown key. `root` is the schema of the whole file."""
    schema = resolve_schema(root, root, data)
    for key in keys:
        child = value_at(data, (key,))
        schema = resolve_schema(root, child_schema(schema, key), child)
        data = child
    return schema


def child_schema(schema: Schema, key: Key) -> Schema:
    """Return the schema of the value or item at `key` of a mapping or list; {} for an unknown key."""
    if isinstance(key, int):
        prefix = schema.get("prefixItems", [])
        child = prefix[key] if key < len(prefix) else schema.get("items", {})
    else:
        patterns = list(schema.get("patternProperties", {}).values())
        child = schema.get("properties", {}).get(key) or (patterns[0] if patterns else {})
    return child if isinstance(child, dict) else {}


def resolve_schema(root: Schema, schema: Schema, data: Any) -> Schema:
    """Return the schema with its references, conditions, and alternatives resolved for the value `data`."""
    for _ in range(MAX_REFERENCES):
        if "$ref" in schema:
            target = root["$defs"][schema["$ref"].rpartition("/")[2]]
            schema = {**target, **{key: value for key, value in schema.items() if key != "$ref"}}
        elif "if" in schema and "else" in schema:
            branch = schema["then" if _meets_condition(schema["if"], data) else "else"]
            schema = _merge_branch(schema, branch, ("if", "then", "else"))
        elif branch := next(_applicable_branches(root, schema, data), None):
            schema = _merge_branch(schema, branch, ("allOf", "oneOf", "anyOf"))
        else:
            break
    return schema


def value_at(data: Any, keys: Sequence[Key]) -> Any:
    """Return the value at `keys`; None if the data have no such value."""
    for key in keys:
        if isinstance(data, dict):
            data = data.get(str(key))
        elif isinstance(data, list) and isinstance(key, int) and 0 <= key < len(data):
            data = data[key]
        else:
            return None
    return data


def _merge_branch(schema: Schema, branch: Schema, removed_keys: tuple[str, ...]) -> Schema:
    """Return the schema without `removed_keys`, merged with a branch. The description of the schema has priority."""
    outer = {key: value for key, value in schema.items() if key not in removed_keys}
    description = outer.get("description") or branch.get("description", "")
    return {**outer, **branch, "description": description}


def _applicable_branches(root: Schema, schema: Schema, data: Any) -> Iterator[Schema]:
    """Yield the branches of allOf, oneOf, and anyOf that apply to the data, the best branch first.

    The order is: `then` of each true condition, references to schemas with the `type` of the data, and the first
    reference as a fallback.
    """
    branches = [each for key in ("allOf", "oneOf", "anyOf") for each in schema.get(key, []) if isinstance(each, dict)]
    conditional = [branch for branch in branches if "if" in branch and "then" in branch]
    yield from (branch["then"] for branch in conditional if _meets_condition(branch["if"], data))
    references = [branch for branch in branches if "$ref" in branch]
    for reference in references:
        target = root["$defs"][reference["$ref"].rpartition("/")[2]]
        type_schema = target.get("properties", {}).get("type", {})
        type_name = value_at(data, ("type",))
        if type_name is not None and type_name in (type_schema.get("const"), *type_schema.get("enum", [])):
            yield reference
    yield from references[:1]


def _meets_condition(condition: Schema, data: Any) -> bool:
    """Return whether the data meet an `if` of a schema. Supports the keywords of simscen's schemas."""
    json_type = condition.get("type")
    if json_type is not None and not isinstance(data, _TYPES[json_type]):
        return False
    if any(value_at(data, (key,)) is None for key in condition.get("required", [])):
        return False
    names = condition.get("propertyNames", {}).get("enum")
    if names is not None and isinstance(data, dict) and not all(key in names for key in data):
        return False
    properties = condition.get("properties", {})
    constants = {key: schema["const"] for key, schema in properties.items() if "const" in schema}
    return all(value_at(data, (key,)) in (None, constant) for key, constant in constants.items())
