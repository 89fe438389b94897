"""Forms for editing the values of a file, made from its JSON Schema.

`keys` are the path to a value in the file: keys of mappings and indices of lists. `data` is the plain content of the
file, on which the choice between alternatives of the schema depends.
"""

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
    """Return the JSON Schema of a kind of file: "scenario" or "world"."""
    schema: Schema = json.loads((PACKAGE / "data" / "schemas" / f"{kind}.schema.json").read_text(encoding="utf-8"))
    return schema


def schema_at(root: Schema, keys: Sequence[Key], data: Any) -> Schema:
    """Return the schema of the value at `keys`; {} if it is unknown. `root` is the schema of the file."""
    schema = resolve_schema(root, root, data)
    for key in keys:
        child = value_at(data, (key,))
        schema = resolve_schema(root, child_schema(schema, key), child)
        data = child
    return schema


def child_schema(schema: Schema, key: Key) -> Schema:
    """Return the schema of the value of a key, or of the item with an index; {} if there is none."""
    if isinstance(key, int):
        prefix = schema.get("prefixItems", [])
        found = prefix[key] if key < len(prefix) else schema.get("items", {})
    else:
        patterns = list(schema.get("patternProperties", {}).values())
        found = schema.get("properties", {}).get(key) or (patterns[0] if patterns else {})
    return found if isinstance(found, dict) else {}


def resolve_schema(root: Schema, schema: Schema, data: Any) -> Schema:
    """Return a schema in which references, conditions, and alternatives are replaced by the schemas that apply.

    `data` is the value to which they must apply.
    """
    for _ in range(MAX_REFERENCES):
        if "$ref" in schema:
            target = root["$defs"][schema["$ref"].rpartition("/")[2]]
            schema = {**target, **{key: value for key, value in schema.items() if key != "$ref"}}
        elif "if" in schema and "else" in schema:
            branch = schema["then" if _applies(schema["if"], data) else "else"]
            schema = _merge_branch(schema, branch, ("if", "then", "else"))
        elif branch := next(_applicable_branches(root, schema, data), None):
            schema = _merge_branch(schema, branch, ("allOf", "oneOf", "anyOf"))
        else:
            break
    return schema


def value_at(data: Any, keys: Sequence[Key]) -> Any:
    """Return the value at `keys`; None if there is none."""
    for key in keys:
        if isinstance(data, dict):
            data = data.get(str(key))
        elif isinstance(data, list) and isinstance(key, int) and 0 <= key < len(data):
            data = data[key]
        else:
            return None
    return data


def alternatives(schema: Schema) -> list[str]:
    """Return the keys of which a mapping must have exactly one, such as the kinds of triggers; [] if there are none."""
    options = [one.get("required", []) for one in schema.get("oneOf", []) if isinstance(one, dict)]
    return [option[0] for option in options if len(option) == 1]


def _merge_branch(schema: Schema, branch: Schema, without: tuple[str, ...]) -> Schema:
    """Return a schema without the keys `without`, to which a branch is added. The outer description has priority."""
    outer = {key: value for key, value in schema.items() if key not in without}
    description = outer.get("description") or branch.get("description", "")
    return {**outer, **branch, "description": description}


def _applicable_branches(root: Schema, schema: Schema, data: Any) -> Iterator[Schema]:
    """Yield the branches of allOf, oneOf, and anyOf that apply to the data, best first.

    These are branches whose condition is true, then references to a schema whose `type` is that in the data, then the
    first reference as a default.
    """
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
    """Return whether an `if` of a schema is true for the data. Supports only what the schemas of simscen use."""
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


MAX_REFERENCES = 8
"""Maximum number of references and conditions that lead to a schema, so that a circle of references ends."""
MAX_DEPTH = 4
"""Maximum depth of nested fields in a form. Deeper values are edited in the text."""
MAX_ITEMS = 12
"""Maximum number of items of a list in a form. Longer lists are edited in the text or on the map."""
MAX_TEXT_FIELD_CHARACTERS = 60
"""Longer strings, and strings with line breaks, get a field with several lines."""
FIRST_VALUE_OF_KEY = {
    "name": "new",
    "description": "description",
    "keyframes": [[0, 0, 0, 0]],
    "through": [[0, 0]],
    "points": [[0, 0], [1, 0]],
}
"""Values of new keys, where the schema suggests none that is useful."""

Keys = tuple[Key, ...]
_EXAMPLE_OF_QUANTITY = re.compile(r"\s*\((?:[a-z ]+), e\.g\. ([^)]*)\)$")


def form_data(kind: str, text: str, data: Any, keys: Keys) -> dict[str, Any]:
    """Return the form of the value at `keys` as JSON data: its help, its fields, and the keys that can be added.

    `data` is the content of the `text` including the files that it extends. The form of the complete file, whose `keys`
    are (), has no nested fields.
    """
    root = schema_of_kind(kind)
    schema = schema_at(root, keys, data)
    value = value_at(data, keys)
    form = _Form(root, text, parse_source(text), 1 if not keys else MAX_DEPTH)
    return form.field(keys, schema, value, required=True, depth=0)


class _Form:
    """Makes the fields of a form with at most `max_depth` levels. `source` is the syntax tree of the text."""

    def __init__(self, root: Schema, text: str, source: SourceNode | None, max_depth: int) -> None:
        self._root, self._text, self._source, self._max_depth = root, text, source, max_depth

    def field(self, keys: Keys, schema: Schema, value: Any, required: bool, depth: int) -> dict[str, Any]:
        """Return the field of the value at `keys`, with the fields of its keys or items.

        `depth` is 0 for the value of the form itself.
        """
        help_, example = _help_and_example(schema)
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
            child = resolve_schema(self._root, child_schema(schema, key), value[key])
            fields.append(self.field((*keys, key), child, value[key], key in needed, depth + 1))
        return {"fields": fields, "addable": self._addable(keys, schema, value)}

    def _addable(self, keys: Keys, schema: Schema, value: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the keys that can be added to a mapping, each with its help and a value for the new key."""
        choices = alternatives(schema)
        has_choice = any(choice in value for choice in choices)
        found = []
        for key, one in schema.get("properties", {}).items():
            if key in value or key.endswith("+") or (key in choices and has_choice):
                continue
            child = resolve_schema(self._root, one, None)
            initial = first_value(self._root, child, key)
            if initial is None or (not keys and isinstance(initial, dict | list)):
                continue
            found.append({"key": key, "help": _help_and_example(child)[0], "value": initial})
        return found

    def _list(self, keys: Keys, schema: Schema, value: list[Any], depth: int) -> dict[str, Any]:
        if len(value) > MAX_ITEMS or depth >= self._max_depth:
            return {"fields": [], "addable": [], "omitted": len(value)}
        fields = []
        for index, item in enumerate(value):
            child = resolve_schema(self._root, child_schema(schema, index), item)
            fields.append(self.field((*keys, index), child, item, required=False, depth=depth + 1))
        return {"fields": fields, "addable": []}

    def _scalar(self, schema: Schema, value: Any, written: SourceNode | None) -> dict[str, Any]:
        if "enum" in schema:
            return {"type": "choice", "choices": schema["enum"], "value": value}
        if isinstance(value, bool) or schema.get("type") == "boolean":
            return {"type": "choice", "choices": [True, False], "value": value}
        if schema.get("type") == "string" or (isinstance(value, str) and "type" not in schema):
            text = "" if value is None else str(value)
            is_long = "\n" in text.strip() or len(text) > MAX_TEXT_FIELD_CHARACTERS
            return {"type": "long text" if is_long else "text", "value": text}
        raw = "" if value is None else str(value)
        if written is not None and written.kind == "scalar" and not written.style:
            raw = self._text[written.start : written.end]
        return {"type": "number", "value": raw}


def first_value(root: Schema, schema: Schema, key: str = "", depth: int = 0) -> Any:
    """Return a value for a new key or item that is valid according to the schema; None if there is no simple one.

    `depth` is the number of mappings and lists around the value, at most MAX_DEPTH.
    """
    if key in FIRST_VALUE_OF_KEY:
        return FIRST_VALUE_OF_KEY[key]
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
            item = resolve_schema(root, child_schema(schema, 0), None)
            one = first_value(root, item, "", depth + 1) if depth < MAX_DEPTH else None
            return None if one is None else [one] * max(1, schema.get("minItems", 1))
        case "object":
            return _first_mapping(root, schema, depth)
    return None


def _first_mapping(root: Schema, schema: Schema, depth: int) -> dict[str, Any] | None:
    """Return a mapping with the required keys; None if one of them has no simple value."""
    if depth >= MAX_DEPTH:
        return None
    properties, made = schema.get("properties", {}), dict[str, Any]()
    for key in schema.get("required", []):
        made[key] = first_value(root, resolve_schema(root, properties.get(key, {}), {}), key, depth + 1)
        if made[key] is None:
            return None
    return made


def _first_number(schema: Schema) -> float:
    """Return 0, 1, or another number within the limits of the schema."""
    low: float = schema["minimum"] if "minimum" in schema else schema.get("exclusiveMinimum", -1.0)
    high: float = schema["maximum"] if "maximum" in schema else schema.get("exclusiveMaximum", 1.0)
    if low < 0 or (low == 0 and "exclusiveMinimum" not in schema):
        return 0
    return max(1.0, low) if high > max(1.0, low) else (low + high) / 2


def _help_and_example(schema: Schema) -> tuple[str, str]:
    """Return the description of a value, and the example of a quantity at its end, such as "0.5 m"; "" for none."""
    paragraphs = str(schema.get("description", "")).split("\n\n")
    text = "\n\n".join(" ".join(part.split()) for part in paragraphs).strip()
    match = _EXAMPLE_OF_QUANTITY.search(text)
    if match is None:
        plain = re.fullmatch(r"[a-z ]+, e\.g\. (.*)", text)
        return ("", plain[1]) if plain else (text, "")
    return text[: match.start()].strip(), match[1]
