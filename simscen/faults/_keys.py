"""Faults whose keys each mean something on some kinds of sensor only."""

from pydantic import BaseModel

from simscen.faults.base import Fault, Instance


def misplaced_key(fault: Fault, instance: Instance) -> tuple[str, str] | None:
    """A key that is given and means nothing there, and why."""
    assert isinstance(fault, BaseModel)
    fitting = fault.keys_of[instance.kind]
    given = [name for name in type(fault).model_fields if name in fault.model_fields_set]
    wrong = next((name for name in given if name not in fitting), None)
    if wrong is None:
        return None
    only = f"only `{'`, `'.join(fitting)}` {'does' if len(fitting) == 1 else 'do'}"
    return wrong, f"`{wrong}` means nothing there, {only}"
