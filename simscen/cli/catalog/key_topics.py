"""What a single key means, by its path: `goals.pose`, `amcl.update_min_a`, `stack.localizer.alpha1`."""

from collections.abc import Iterator, Sequence

from pydantic import BaseModel

from simscen.cli.catalog.json_schema import MODELS
from simscen.cli.catalog.topics import OPTIONAL, Field, Topic, fields_of
from simscen.loading.schema.lookup import models_at
from simscen.spec.choice import Choice


def key_topics(path: str, known: Sequence[Topic]) -> list[Topic]:
    """Every key that a path may mean: below a topic, or from the top of a file; a bare key means it wherever it is."""
    parts = path.split(".")
    if len(parts) == 1:
        found = [
            _key(f"{topic.name}.{path}", field, ()) for topic in known for field in topic.fields if field.key == path
        ]
    else:
        found = [topic for model, keys in _starts(parts, known) for topic in _below(model, keys, path)]
        name, _, key = path.rpartition(".")
        listed = [row for topic in known if topic.name == name for row in topic.rows if row.key == key]
        found += [_key(path, row, ()) for row in listed]
    return list({(topic.name, topic.text): topic for topic in found}.values())


def keys_of_topics(known: Sequence[Topic]) -> list[str]:
    """The paths of all keys of all topics."""
    return [f"{topic.name}.{field.key}" for topic in known for field in topic.fields]


def _starts(parts: list[str], known: Sequence[Topic]) -> Iterator[tuple[type[BaseModel], list[str]]]:
    for length in (1, 2):
        prefix, keys = ".".join(parts[:length]), parts[length:]
        for topic in known:
            if keys and topic.model is not None and prefix in (topic.name, f"{topic.group}.{topic.name}"):
                yield topic.model, keys
    for model in MODELS.values():
        yield model, parts


def _below(model: type[BaseModel], keys: list[str], path: str) -> Iterator[Topic]:
    """The last of `keys` below a model, with the keys of what stands there where that is one mapping."""
    *above, key = keys
    for holder in models_at(model, _with_items(model, above)):
        for field in fields_of(holder):
            if field.key == key:
                within = models_at(holder, _with_items(holder, [key]))
                rows = fields_of(within[0]) if len(within) == 1 and not issubclass(within[0], Choice) else []
                yield _key(path, field, tuple(rows))


def _with_items(model: type[BaseModel], keys: list[str]) -> list[str | int]:
    """The keys with a number behind each that holds a list."""
    way: list[str | int] = []
    for key in keys:
        way.append(key)
        if not models_at(model, way) or models_at(model, [*way, 0]) != models_at(model, way):
            way.append(0)
    return way


def _key(path: str, field: Field, rows: tuple[Field, ...]) -> Topic:
    needed = (
        "required" if not field.default else "optional" if field.default == OPTIONAL else f"default {field.default}"
    )
    text = f"{field.text}\n\n{field.kind} ({needed})" if field.text else f"{field.kind} ({needed})"
    return Topic("key", path, None, text, rows=rows)
