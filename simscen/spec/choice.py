"""Base class of mappings in a file that must have exactly one of several keys, such as `{spawn: …}` or `{push: …}`.

simscen ships some of the keys, and installed packages can add others. Packages are searched only if a file uses a key
that simscen does not ship, or if all keys are requested.
"""

import contextlib
from functools import cache
from typing import Annotated, Any, ClassVar, get_args

from pydantic import BaseModel, Field, ModelWrapValidatorHandler, ValidationError, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import InitErrorDetails

from simscen.spec.base import LazySpec, Spec


class Choice(Spec):
    """Mapping with exactly one key out of several, e.g. `spawn: {…}`, plus optional modifiers.

    A subclass has one optional field for each choice; the fields in `modifiers` can be combined with any choice. Unlike
    with a union by `type`, editors and validators can report the exact mistake.

    If `group` is a group of the registry, installed packages can add choices. A mapping with an added key becomes an
    instance of an extended class (`with_installed_choices`) that has a field for each added choice.
    """

    modifiers: ClassVar[frozenset[str]] = frozenset()
    group: ClassVar[str] = ""
    original_class: ClassVar[type["Choice"] | None] = None
    """Class from which an extended class was created; None for any other class."""

    @classmethod
    def choices(cls) -> dict[str, str]:
        """Return the name of the field of each choice, by the key in YAML."""
        return {f.alias or name: name for name, f in cls.model_fields.items() if name not in cls.modifiers}

    @classmethod
    @cache
    def known_keys(cls) -> frozenset[str]:
        """Return all valid keys in YAML, including modifiers."""
        return frozenset(field.alias or name for name, field in cls.model_fields.items())

    @classmethod
    def addresses(cls) -> dict[str, str]:
        """Return the addresses "module:Class" of the specifications by key; choices without one are left out."""
        addresses = {key: _address(cls.model_fields[name]) for key, name in cls.choices().items()}
        return {key: address for key, address in addresses.items() if address}

    @model_validator(mode="wrap")
    @classmethod
    def _use_installed(cls, value: Any, handler: ModelWrapValidatorHandler["Choice"]) -> "Choice":
        if (
            cls.group
            and cls.original_class is None
            and isinstance(value, dict)
            and not cls.known_keys().issuperset(value)
        ):
            extended = with_installed_choices(cls)
            if not extended.known_keys().isdisjoint(value.keys() - cls.known_keys()):
                return extended.model_validate(value, by_alias=True, by_name=False)
        if isinstance(value, dict) and (invalid := cls._python_names().intersection(value)):
            # Older pydantic versions accept field names as keys inside a wrapped model.
            errors = [InitErrorDetails(type="extra_forbidden", loc=(key,), input=value[key]) for key in sorted(invalid)]
            raise ValidationError.from_exception_data(cls.__name__, errors)
        return handler(value)

    @classmethod
    @cache
    def _python_names(cls) -> frozenset[str]:
        """Return the names of fields that differ from their keys in YAML, e.g. `for_`."""
        return frozenset(name for name, field in cls.model_fields.items() if field.alias not in (None, name))

    @model_validator(mode="after")
    def _check_one_choice(self) -> "Choice":
        given = self._given()
        if not given:
            raise ValueError(f"expected one of: {', '.join(self.choices())}")
        if len(given) > 1:
            raise ValueError(f"only one of {', '.join(given)} may be given here")
        return self

    def _given(self) -> list[str]:
        return [key for key, name in self.choices().items() if getattr(self, name) is not None]

    @property
    def kind(self) -> str:
        """The key that is given."""
        return self._given()[0]

    @property
    def chosen(self) -> BaseModel:
        """The specification under the key that is given."""
        spec = getattr(self, self.choices()[self.kind])
        assert isinstance(spec, BaseModel)
        return spec

    @property
    def added_by(self) -> str:
        """Text for messages that names the package that added the key; "" if simscen ships the key.

        Example: " (criterion `dwell` of yardwork 1.2)"
        """
        if self.original_class is None:
            return ""
        from simscen.spec.registry import find

        found = find(self.group, self.kind)
        return f" ({self.group} `{self.kind}` of {found.origin})" if found is not None and not found.is_shipped else ""

    def __reduce_ex__(self, protocol: Any) -> Any:
        if self.original_class is None:
            return super().__reduce_ex__(protocol)
        return empty_instance, (self.original_class,), self.__getstate__()


@cache
def with_installed_choices(choice: type[Choice]) -> type[Choice]:
    """Return the extended class: a subclass with a field for each key that installed packages add.

    Returns the class itself if there are no such keys.
    """
    from pydantic import create_model

    from simscen.spec.extensible_union import PluginSpec
    from simscen.spec.registry import installed

    if choice.original_class is not None or not choice.group:
        return choice
    fields: dict[str, Any] = {
        f"plugin_{entry.name}": (
            Annotated[BaseModel | None, PluginSpec(*entry.value.partition(":")[::2], entry)],
            Field(default=None, alias=entry.name),
        )
        for entry in installed(choice.group)
        if entry.name not in choice.known_keys()
    }
    if not fields:
        return choice
    extended = create_model(
        choice.__name__, __base__=choice, __module__=choice.__module__, __doc__=choice.__doc__, **fields
    )
    extended.original_class = choice
    return extended


def installed_choices(choice: type[Choice]) -> dict[str, type[BaseModel]]:
    """Return the usable specifications that installed packages add to a choice, by key."""
    from simscen.spec.registry import BrokenPlugin, installed

    found = {}
    for entry in installed(choice.group) if choice.group else ():
        if entry.name not in choice.known_keys():
            with contextlib.suppress(BrokenPlugin):
                found[entry.name] = entry.load()
    return found


def empty_instance(original_class: type[Choice]) -> Choice:
    """Return an instance of the extended class without fields, for unpickling.

    Pickle cannot import an extended class by its name, because each process creates the class at run time.
    """
    extended = with_installed_choices(original_class)
    return extended.__new__(extended)


def _address(field: FieldInfo) -> str:
    """Return the address of the specification of a field; "" for a list and for another choice."""
    lazy = next((item for item in field.metadata if isinstance(item, LazySpec)), None)
    if lazy is not None:
        return f"{lazy.module}:{lazy.name}"
    kinds = [kind for kind in get_args(field.annotation) if isinstance(kind, type) and issubclass(kind, Spec)]
    kinds = [kind for kind in kinds if not issubclass(kind, Choice)]
    return f"{kinds[0].__module__}:{kinds[0].__name__}" if kinds else ""
