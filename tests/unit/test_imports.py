"""Modules import each other in one direction only."""

from collections.abc import Mapping

import grimp


def circles(imports: Mapping[str, set[str]]) -> list[str]:
    """The modules that are left when those that import nothing, or that nothing imports, are taken away in turns."""
    left = {module: set(imported) & imports.keys() for module, imported in imports.items()}
    while True:
        imported = set().union(*left.values()) if left else set()
        ends = {module for module, needed in left.items() if not needed or module not in imported}
        if not ends:
            return sorted(left)
        left = {module: needed - ends for module, needed in left.items() if module not in ends}


def test_import_cycle_is_detected():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": set()}) == ["b", "c"]
    assert circles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_modules_have_no_import_cycle_even_inside_functions():
    graph = grimp.build_graph("simscen", cache_dir=None)
    assert len(graph.modules) > 100
    assert circles({module: graph.find_modules_directly_imported_by(module) for module in graph.modules}) == []
