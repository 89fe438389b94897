"""Test of values that are cached on an instance."""

import gc
import weakref

from simscen.core.decorators import cached_on_instance


class Owner:
    """Instance that caches values."""


def test_cached_value_is_computed_once_per_object_and_arguments():
    calls = []

    @cached_on_instance
    def cached_function(owner, argument, option=0):
        calls.append((argument, option))
        return owner, [argument, option]

    first, second = Owner(), Owner()
    assert cached_function(first, 1) is cached_function(first, 1)
    assert cached_function(first, 1, option=2) is cached_function(first, 1, option=2)
    assert cached_function(second, 1) is not cached_function(first, 1)
    assert calls == [(1, 0), (1, 2), (1, 0)]
    reference = weakref.ref(first)
    del first
    gc.collect()
    assert reference() is None
