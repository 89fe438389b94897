"""Compressed in-memory storage for the results of many runs: a list, and a mapping by run key."""

import pickle
import sys
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import overload

from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import RunFinished

MAX_UNCOMPRESSED = 2000
"""Maximum number of results that a store keeps uncompressed."""


class RunStore(Sequence[RunFinished]):
    """List of results. Results after the first MAX_UNCOMPRESSED are compressed, and restored at each access."""

    def __init__(self, runs: Iterable[RunFinished] = ()) -> None:
        self._entries: list[RunFinished | bytes] = []
        self._sort_keys: list[tuple[str, str, str, int, str]] = []
        """File, scenario, variation, seed, and stack of each result."""
        self._dictionary = b""
        """Dictionary of the compression: the first pickled result, with which other results share most words."""
        self.extend(runs)

    def append(self, run: RunFinished) -> None:
        """Add a result at the end."""
        key = run.key
        self._sort_keys.append(
            (sys.intern(run.result.path), sys.intern(key.scenario), key.variation, key.seed, sys.intern(key.stack_name))
        )
        self._entries.append(run if len(self._entries) < MAX_UNCOMPRESSED else self._compress(run))

    def extend(self, runs: Iterable[RunFinished]) -> None:
        """Add results at the end."""
        for run in runs:
            self.append(run)

    def in_order(self) -> "RunStore":
        """Return a store with the same results, sorted by file, scenario, variation, seed, and stack."""
        return self.select(sorted(range(len(self)), key=self._sort_keys.__getitem__))

    def select(self, indices: Iterable[int]) -> "RunStore":
        """Return a store with the results at these indices."""
        selected = RunStore()
        selected._dictionary = self._dictionary
        for index in indices:
            selected._entries.append(self._entries[index])
            selected._sort_keys.append(self._sort_keys[index])
        return selected

    def __len__(self) -> int:
        return len(self._entries)

    @overload
    def __getitem__(self, index: int) -> RunFinished: ...

    @overload
    def __getitem__(self, index: slice) -> "RunStore": ...

    def __getitem__(self, index: int | slice) -> "RunFinished | RunStore":
        if isinstance(index, slice):
            return self.select(range(*index.indices(len(self))))
        return self._restore(self._entries[index])

    def __iter__(self) -> Iterator[RunFinished]:
        return map(self._restore, self._entries)

    def _compress(self, run: RunFinished) -> bytes:
        data = pickle.dumps(run, pickle.HIGHEST_PROTOCOL)
        self._dictionary = self._dictionary or data
        compressor = zlib.compressobj(1, zdict=self._dictionary)
        return compressor.compress(data) + compressor.flush()

    def _restore(self, entry: RunFinished | bytes) -> RunFinished:
        if isinstance(entry, RunFinished):
            return entry
        run = pickle.loads(zlib.decompressobj(zdict=self._dictionary).decompress(entry))
        assert isinstance(run, RunFinished)
        return run


class FinishedRuns(Mapping[RunKey, RunFinished]):
    """Newest result of each run by key. `store` contains all results, in the order of the calls of `add`."""

    def __init__(self) -> None:
        self._index: dict[RunKey, int] = {}
        self.store = RunStore()

    def add(self, key: RunKey, run: RunFinished) -> None:
        """Add the newest result of a run."""
        self._index[key] = len(self.store)
        self.store.append(run)

    def index(self, key: RunKey) -> int | None:
        """Return the index of the newest result of a run in `store`; None if there is no result."""
        return self._index.get(key)

    def __getitem__(self, key: RunKey) -> RunFinished:
        return self.store[self._index[key]]

    def __iter__(self) -> Iterator[RunKey]:
        return iter(self._index)

    def __len__(self) -> int:
        return len(self._index)
