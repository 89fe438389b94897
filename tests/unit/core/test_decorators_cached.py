"""Tests of cached values."""

import gc
import weakref

from simscen.core.decorators import cached_on_instance


class Thing:
    pass


def test_cached_value_is_computed_once_per_object_and_arguments():
    asked = []

    @cached_on_instance
    def made(thing, more, last=0):
        asked.append((more, last))
        return thing, [more, last]

    one, other = Thing(), Thing()
    assert made(one, 1) is made(one, 1)
    assert made(one, 1, last=2) is made(one, 1, last=2)
    assert made(other, 1) is not made(one, 1)
    assert asked == [(1, 0), (1, 2), (1, 0)]
    gone = weakref.ref(one)
    del one
    gc.collect()
    assert gone() is None
