"""Forms for the values of a file, made from its JSON Schema, and lookup of the schema of a value."""

import json
import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

from simscen.core.version import PACKAGE
from simscen.loading.yaml.source_nodes import SourceNode, parse_source, source_at
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
    conditional = [union for union in unions if "if" in union and "then" in union]
    yield from (one["then"] for one in conditional if _applies(one["if"], data))
    plain = [union for union in unions if "$ref" in union]
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


MAX_DEPTH = 4
MAX_ITEMS = 12
"""Longer lists are edited in the text, or on the map."""
MAX_TEXT_FIELD = 60
"""Texts that are longer, or have line breaks, get a field of several lines."""
PREFERRED = {
    "name": "new",
    "description": "description",
    "keyframes": [[0, 0, 0, 0]],
    "through": [[0, 0]],
    "points": [[0, 0], [1, 0]],
}
"""First values of keys for which the schema suggests none."""

Keys = tuple[Key, ...]
_UNIT = re.compile(r"\s*\((?:[a-z ]+), e\.g\. ([^)]*)\)$")


def form_data(kind: str, text: str, data: Any, keys: Keys) -> dict[str, Any]:
    """Return the form of the value at `keys`: its help, its fields, and the keys that can be added.

    `data` is the content of the text with what it extends. The form of the whole file has no nested fields.
    """
    root = schema_of_kind(kind)
    schema = schema_at(root, keys, data)
    value = value_at(data, keys)
    form = _Form(root, text, parse_source(text), 1 if not keys else MAX_DEPTH)
    return form.field(keys, schema, value, required=True, depth=0)


class _Form:
    def __init__(self, root: Schema, text: str, source: SourceNode | None, max_depth: int) -> None:
        self._root, self._text, self._source, self._max_depth = root, text, source, max_depth

    def field(self, keys: Keys, schema: Schema, value: Any, required: bool, depth: int) -> dict[str, Any]:
        """Return the field of a value, with the fields in it."""
        help_, example = _help(schema)
        written = None if self._source is None or not keys else source_at(self._source, keys)
        base = {
            "key": str(keys[-1]) if keys else "",
            "keys": list(keys),
            "help": help_,
            "example": example,
            "required": required,
            "written": written is not None or not keys,
        }
        if isinstance(value, dict):
            return {**base, "type": "group", **self._group(keys, schema, value, depth)}
        if isinstance(value, list):
            return {**base, "type": "list", **self._list(keys, schema, value, depth)}
        return {**base, **self._scalar(schema, value, written)}

    def _group(self, keys: Keys, schema: Schema, value: dict[str, Any], depth: int) -> dict[str, Any]:
        needed = set(schema.get("required", []))
        shown = [] if depth >= self._max_depth else list(value)
        if depth == 0 and not keys:
            shown = [key for key in value if not isinstance(value[key], dict | list)]
        fields = []
        for key in shown:
            below = resolved(self._root, below_of(schema, key), value[key])
            fields.append(self.field((*keys, key), below, value[key], key in needed, depth + 1))
        return {"fields": fields, "addable": self._addable(keys, schema, value)}

    def _addable(self, keys: Keys, schema: Schema, value: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the keys that can be added to a mapping, each with its help and a first value."""
        choices = alternatives(schema)
        has_choice = any(choice in value for choice in choices)
        found = []
        for key, one in schema.get("properties", {}).items():
            if key in value or key.endswith("+") or (key in choices and has_choice):
                continue
            below = resolved(self._root, one, None)
            initial = first_value(self._root, below, key)
            if initial is None or (not keys and isinstance(initial, dict | list)):
                continue
            found.append({"key": key, "help": _help(below)[0], "value": initial})
        return found

    def _list(self, keys: Keys, schema: Schema, value: list[Any], depth: int) -> dict[str, Any]:
        if len(value) > MAX_ITEMS or depth >= self._max_depth:
            return {"fields": [], "addable": [], "omitted": len(value)}
        fields = []
        for index, item in enumerate(value):
            below = resolved(self._root, below_of(schema, index), item)
            fields.append(self.field((*keys, index), below, item, required=False, depth=depth + 1))
        return {"fields": fields, "addable": []}

    def _scalar(self, schema: Schema, value: Any, written: SourceNode | None) -> dict[str, Any]:
        if "enum" in schema:
            return {"type": "choice", "choices": schema["enum"], "value": value}
        if isinstance(value, bool) or schema.get("type") == "boolean":
            return {"type": "choice", "choices": [True, False], "value": value}
        if schema.get("type") == "string" or (isinstance(value, str) and "type" not in schema):
            text = "" if value is None else str(value)
            is_long = "\n" in text.strip() or len(text) > MAX_TEXT_FIELD
            return {"type": "long text" if is_long else "text", "value": text}
        raw = "" if value is None else str(value)
        if written is not None and written.kind == "scalar" and not written.style:
            raw = self._text[written.start : written.end]
        return {"type": "number", "value": raw}


def first_value(root: Schema, schema: Schema, key: str = "", depth: int = 0) -> Any:
    """Return a valid value for a new key or item as far as the schema says one; None if there is no simple one."""
    if key in PREFERRED:
        return PREFERRED[key]
    if "default" in schema and schema["default"] not in (None, "", [], {}):
        return schema["default"]
    if "const" in schema:
        return schema["const"]
    if "enum" in schema:
        return schema["enum"][0]
    kinds = schema.get("type", "")
    match kinds[0] if isinstance(kinds, list) and kinds else kinds:
        case "boolean":
            return True
        case "number" | "integer":
            return _first_number(schema)
        case "string":
            return "new"
        case "array":
            item = resolved(root, below_of(schema, 0), None)
            one = first_value(root, item, "", depth + 1) if depth < MAX_DEPTH else None
            return None if one is None else [one] * max(1, schema.get("minItems", 1))
        case "object":
            return _first_mapping(root, schema, depth)
    return None


def _first_mapping(root: Schema, schema: Schema, depth: int) -> Any:
    if depth >= MAX_DEPTH:
        return None
    properties, made = schema.get("properties", {}), {}
    for key in schema.get("required", []):
        made[key] = first_value(root, resolved(root, properties.get(key, {}), {}), key, depth + 1)
        if made[key] is None:
            return None
    return made


def _first_number(schema: Schema) -> float:
    low: float = schema["minimum"] if "minimum" in schema else schema.get("exclusiveMinimum", -1.0)
    high: float = schema["maximum"] if "maximum" in schema else schema.get("exclusiveMaximum", 1.0)
    if low < 0 or (low == 0 and "exclusiveMinimum" not in schema):
        return 0
    return max(1.0, low) if high > max(1.0, low) else (low + high) / 2


def _help(schema: Schema) -> tuple[str, str]:
    """Return the description of a value without the example of a quantity, and that example."""
    paragraphs = str(schema.get("description", "")).split("\n\n")
    text = "\n\n".join(" ".join(part.split()) for part in paragraphs).strip()
    match = _UNIT.search(text)
    if match is None:
        plain = re.fullmatch(r"[a-z ]+, e\.g\. (.*)", text)
        return ("", plain[1]) if plain else (text, "")
    return text[: match.start()].strip(), match[1]
