"""Find the part of a JSON Schema that describes a value of a file."""

import json
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

from simscen.core.version import PACKAGE
from simscen.loading.yaml.tree import Key

Schema = dict[str, Any]
_TYPES: dict[str, type | tuple[type, ...]] = {
    "string": str,
    "array": list,
    "object": dict,
    "boolean": bool,
    "integer": int,
    "number": (int, float),
    "null": type(None),
}


@lru_cache(maxsize=4)
def schema_of_kind(kind: str) -> Schema:
    """Return the schema of a kind of file, such as "scenario"."""
    schema: Schema = json.loads((PACKAGE / "data" / "schemas" / f"{kind}.schema.json").read_text(encoding="utf-8"))
    return schema


def schema_at(root: Schema, keys: Sequence[Key], data: Any) -> Schema:
    """Return the schema of the value at `keys` of a file with the content `data`; {} if it is unknown."""
    schema = resolved(root, root, data)
    for key in keys:
        below = value_at(data, (key,))
        schema = resolved(root, below_of(schema, key), below)
        data = below
    return schema


def below_of(schema: Schema, key: Key) -> Schema:
    """Return the schema of a key or an item of a value; {} if there is none."""
    if isinstance(key, int):
        prefix = schema.get("prefixItems", [])
        found = prefix[key] if key < len(prefix) else schema.get("items", {})
    else:
        patterns = list(schema.get("patternProperties", {}).values())
        found = schema.get("properties", {}).get(key) or (patterns[0] if patterns else {})
    return found if isinstance(found, dict) else {}


def resolved(root: Schema, schema: Schema, data: Any) -> Schema:
    """Return a schema with its reference and its conditions replaced by what applies to `data`."""
    for _ in range(8):
        if "$ref" in schema:
            target = root["$defs"][schema["$ref"].rpartition("/")[2]]
            schema = {**target, **{key: value for key, value in schema.items() if key != "$ref"}}
        elif "if" in schema and "else" in schema:
            branch = schema["then" if _applies(schema["if"], data) else "else"]
            schema = _merged(schema, branch, ("if", "then", "else"))
        elif chosen := next(_applying(root, schema, data), None):
            schema = _merged(schema, chosen, ("allOf", "oneOf", "anyOf"))
        else:
            break
    return schema


def value_at(data: Any, keys: Sequence[Key]) -> Any:
    """Return the value at `keys` of plain data; None if there is none."""
    for key in keys:
        if isinstance(data, dict):
            data = data.get(str(key))
        elif isinstance(data, list) and isinstance(key, int) and 0 <= key < len(data):
            data = data[key]
        else:
            return None
    return data


def alternatives(schema: Schema) -> list[str]:
    """Return the keys of which a mapping has exactly one, such as the kinds of triggers; [] if there are none."""
    options = [one.get("required", []) for one in schema.get("oneOf", []) if isinstance(one, dict)]
    return [option[0] for option in options if len(option) == 1]


def _merged(schema: Schema, branch: Schema, without: tuple[str, ...]) -> Schema:
    """Return a branch with the description of the schema that it is a branch of."""
    outer = {key: value for key, value in schema.items() if key not in without}
    description = outer.get("description") or branch.get("description", "")
    return {**outer, **branch, "description": description}


def _applying(root: Schema, schema: Schema, data: Any) -> Iterator[Schema]:
    """Yield the alternatives of a tagged union that fit the `type` in the data, and the first one if there is none."""
    unions = [one for key in ("allOf", "oneOf", "anyOf") for one in schema.get(key, []) if isinstance(one, dict)]
    conditional = [one for one in unions if "if" in one and "then" in one]
    yield from (one["then"] for one in conditional if _applies(one["if"], data))
    plain = [one for one in unions if "$ref" in one]
    for one in plain:
        target = root["$defs"][one["$ref"].rpartition("/")[2]]
        kind = target.get("properties", {}).get("type", {})
        written = value_at(data, ("type",))
        if written is not None and written in (kind.get("const"), *kind.get("enum", [])):
            yield one
    yield from plain[:1]


def _applies(condition: Schema, data: Any) -> bool:
    """Return whether a condition of the kinds that our schemas use is true for the data."""
    wanted = condition.get("type")
    if wanted is not None and not isinstance(data, _TYPES[wanted]):
        return False
    if any(value_at(data, (key,)) is None for key in condition.get("required", [])):
        return False
    names = condition.get("propertyNames", {}).get("enum")
    if names is not None and isinstance(data, dict) and not all(key in names for key in data):
        return False
    constants = {key: one["const"] for key, one in condition.get("properties", {}).items() if "const" in one}
    return all(value_at(data, (key,)) in (None, constant) for key, constant in constants.items())
