"""Base class of YAML mappings with one of several keys, such as `{spawn: …}`. Packages can add keys."""

from functools import cache
from typing import Annotated, Any, ClassVar, get_args

from pydantic import BaseModel, Field, ModelWrapValidatorHandler, ValidationError, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import InitErrorDetails

from simscen.spec.base import LazySpec, Spec


class Choice(Spec):
    """Mapping with exactly one of several keys (the choices), e.g. `spawn: {…}`, and optional modifiers.

    A subclass has one optional field for each choice. A mapping with a key of an installed package becomes an instance
    of an extended class: a subclass with an additional field for each key that installed packages add.
    """

    modifiers: ClassVar[frozenset[str]] = frozenset()
    """Names of the fields that can be combined with any choice."""
    group: ClassVar[str] = ""
    """Registry group in which installed packages can add choices; "" if they cannot add any."""
    original_class: ClassVar[type["Choice"] | None] = None
    """Class that an extended class extends; None for any other class."""

    @classmethod
    def choices(cls) -> dict[str, str]:
        """Return the field names of all choices, by key in YAML."""
        return {f.alias or name: name for name, f in cls.model_fields.items() if name not in cls.modifiers}

    @classmethod
    @cache
    def known_keys(cls) -> frozenset[str]:
        """Return the keys in YAML of all choices and modifiers."""
        return frozenset(field.alias or name for name, field in cls.model_fields.items())

    @classmethod
    def addresses(cls) -> dict[str, str]:
        """Return the address "module:Class" of each choice, by YAML key. Lists and other Choices are left out."""
        addresses = {key: _address(cls.model_fields[name]) for key, name in cls.choices().items()}
        return {key: address for key, address in addresses.items() if address}

    @model_validator(mode="wrap")
    @classmethod
    def _use_installed(cls, value: Any, handler: ModelWrapValidatorHandler["Choice"]) -> "Choice":
        """Validate a mapping. If it has a key of an installed package, the extended class validates it."""
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
        """Return the field names that differ from their keys in YAML, e.g. `for_`."""
        return frozenset(name for name, field in cls.model_fields.items() if field.alias not in (None, name))

    @model_validator(mode="after")
    def _check_one_choice(self) -> "Choice":
        given = self._given_keys()
        if not given:
            raise ValueError(f"expected one of: {', '.join(self.choices())}")
        if len(given) > 1:
            raise ValueError(f"only one of {', '.join(given)} may be given here")
        return self

    def _given_keys(self) -> list[str]:
        return [key for key, name in self.choices().items() if getattr(self, name) is not None]

    @property
    def kind(self) -> str:
        """Key in YAML of the choice in the mapping, e.g. "spawn"."""
        return self._given_keys()[0]

    @property
    def chosen(self) -> Any:
        """Specification under the key `kind`."""
        return getattr(self, self.choices()[self.kind])

    @property
    def plugin_suffix(self) -> str:
        """Plug-in of the choice for messages, e.g. " (criterion `dwell` of yardwork 1.2)"; "" if simscen ships it."""
        if self.original_class is None:
            return ""
        from simscen.spec.registry import find_type

        found = find_type(self.group, self.kind)
        return f" ({self.group} `{self.kind}` of {found.origin})" if found is not None and not found.is_shipped else ""

    def __reduce_ex__(self, protocol: Any) -> Any:
        if self.original_class is None:
            return super().__reduce_ex__(protocol)
        return _empty_instance, (self.original_class,), self.__getstate__()


@cache
def with_installed_choices(choice: type[Choice]) -> type[Choice]:
    """Return the extended class of a Choice class; the class itself if no installed package adds a key."""
    from pydantic import create_model

    from simscen.spec.extensible_union import PluginSpec
    from simscen.spec.registry import installed_types

    if choice.original_class is not None or not choice.group:
        return choice
    fields: dict[str, Any] = {
        f"plugin_{entry.name}": (
            Annotated[BaseModel | None, PluginSpec(*entry.value.partition(":")[::2], entry)],
            Field(default=None, alias=entry.name),
        )
        for entry in installed_types(choice.group)
        if entry.name not in choice.known_keys()
    }
    if not fields:
        return choice
    extended = create_model(
        choice.__name__, __base__=choice, __module__=choice.__module__, __doc__=choice.__doc__, **fields
    )
    extended.original_class = choice
    return extended


def _empty_instance(original_class: type[Choice]) -> Choice:
    """Return an uninitialized instance of the extended class of a Choice class, for unpickling."""
    # Pickle cannot import an extended class by its name, because each process creates the class at run time.
    extended = with_installed_choices(original_class)
    return extended.__new__(extended)


def _address(field: FieldInfo) -> str:
    """Return the address "module:Class" of the specification of a field; "" for a list or another Choice."""
    for item in field.metadata:
        if isinstance(item, LazySpec):
            return f"{item.module}:{item.name}"
    for kind in get_args(field.annotation):
        if isinstance(kind, type) and issubclass(kind, Spec) and not issubclass(kind, Choice):
            return f"{kind.__module__}:{kind.__name__}"
    return ""
