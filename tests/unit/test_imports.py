"""Tests that simscen has no import cycles."""

from collections.abc import Mapping

import grimp


def cycles(imports: Mapping[str, set[str]]) -> list[str]:
    """Return the modules that remain when those without imports or importers are removed repeatedly."""
    remaining = {module: set(imported) & imports.keys() for module, imported in imports.items()}
    while True:
        imported = set().union(*remaining.values()) if remaining else set()
        leaves = {module for module, needed in remaining.items() if not needed or module not in imported}
        if not leaves:
            return sorted(remaining)
        remaining = {module: needed - leaves for module, needed in remaining.items() if module not in leaves}


def test_import_cycle_is_detected():
    assert cycles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": set()}) == ["b", "c"]
    assert cycles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_modules_have_no_import_cycle_even_inside_functions():
    graph = grimp.build_graph("simscen", cache_dir=None)
    assert len(graph.modules) > 100
    assert cycles({module: graph.find_modules_directly_imported_by(module) for module in graph.modules}) == []
