"""Contract tests for plug-ins. They check that a component, such as a planner, keeps the rules of the protocol.

A promise is one rule. A contract is the set of all promises of one kind of component.

    @pytest.mark.parametrize("promise", promises_of(MyPlannerSpec()), ids=str)
    def test_my_planner(promise):
        promise.check()

`pytest --simscen-contract my_package:MyPlanner` does the same without a test.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simscen.testing.contracts.base import Contract, Promise, PromiseBroken
    from simscen.testing.targets import contracts_of, promises_of

__all__ = ["Contract", "Promise", "PromiseBroken", "contracts_of", "promises_of"]

_MODULES = {
    "Contract": "contracts.base",
    "Promise": "contracts.base",
    "PromiseBroken": "contracts.base",
    "contracts_of": "targets",
    "promises_of": "targets",
}


def __getattr__(name: str) -> Any:
    """Import a name of `__all__` on first use, because every start of pytest imports this package."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
