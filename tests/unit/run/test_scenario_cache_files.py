"""Tests of the cache on disk, which sessions share: validity, ownership, and size of its files."""

import errno
import os
import threading
from pathlib import Path

import pytest

from simscen.run.disk_cache import CACHE_FORMAT, DiskCache, cache_folder, disk_usage, is_private_folder

KEY, OTHER = "a" * 64, "b" * 64


def test_cache_folder_depends_on_the_environment_variables() -> None:
    assert cache_folder({"HOME": "/home/me"}) == Path("/home/me/.cache/simscen", CACHE_FORMAT)
    assert cache_folder({"HOME": "/home/me", "XDG_CACHE_HOME": "/fast"}) == Path("/fast/simscen", CACHE_FORMAT)
    assert cache_folder({"HOME": "/home/me", "XDG_CACHE_HOME": "relative"}) == Path(
        "/home/me/.cache/simscen", CACHE_FORMAT
    )
    assert cache_folder({"HOME": "/home/me", "SIMSCEN_CACHE_DIR": "/mine"}) == Path("/mine", CACHE_FORMAT)
    for off in ("off", "", "relative"):
        assert cache_folder({"HOME": "/home/me", "SIMSCEN_CACHE_DIR": off}) is None
    assert cache_folder({}) is None


def test_cache_is_found_by_the_next_session(tmp_path: Path) -> None:
    folder = tmp_path / "cache" / CACHE_FORMAT
    assert DiskCache(folder).get(KEY) is None
    DiskCache(folder).put(KEY, b"content")
    assert DiskCache(folder).get(KEY) == b"content"
    assert DiskCache(folder).get(OTHER) is None
    assert folder.stat().st_mode & 0o777 == 0o700
    assert [path.name for path in folder.iterdir()] == [KEY]


@pytest.mark.parametrize("damage", ["empty", "cut", "changed", "swapped", "link", "folder", "fifo"])
def test_damaged_cache_file_is_replaced(tmp_path: Path, damage: str) -> None:
    cache = DiskCache(tmp_path / "c")
    cache.put(KEY, b"content")
    cache.put(OTHER, b"of another")
    file = tmp_path / "c" / KEY
    whole = file.read_bytes()
    file.unlink()
    match damage:
        case "empty":
            file.write_bytes(b"")
        case "cut":
            file.write_bytes(whole[:-1])
        case "changed":
            file.write_bytes(whole[:-1] + b"T")
        case "swapped":
            file.write_bytes((tmp_path / "c" / OTHER).read_bytes())
        case "link":
            (tmp_path / "elsewhere").write_bytes(whole)
            file.symlink_to(tmp_path / "elsewhere")
        case "folder":
            file.mkdir()
        case "fifo":
            os.mkfifo(file)
    assert cache.get(KEY) is None
    cache.put(KEY, b"content")
    assert cache.get(KEY) == (None if damage == "folder" else b"content")


def test_a_folder_that_other_users_can_write_to_is_not_used(tmp_path: Path) -> None:
    cache = DiskCache(tmp_path / "c")
    cache.put(KEY, b"content")
    (tmp_path / "c").chmod(0o777)
    assert cache.get(KEY) is None
    cache.put(OTHER, b"more")
    assert not (tmp_path / "c" / OTHER).exists()
    assert not is_private_folder(tmp_path / "nowhere")


def test_least_recently_used_cache_file_is_deleted_first(tmp_path: Path) -> None:
    keys = [f"{number:064x}" for number in range(6)]
    cache = DiskCache(tmp_path, max_bytes=500)
    for number, key in enumerate(keys[:4]):
        cache.put(key, bytes(68))
        os.utime(tmp_path / key, (number, number))
    assert DiskCache(tmp_path, 500).get(keys[0]) == bytes(68), "this makes it the most recently used"
    for key in keys[4:]:
        DiskCache(tmp_path, 500).put(key, bytes(68))
    assert sorted(path.name for path in tmp_path.iterdir()) == [keys[0], *keys[2:]]
    assert disk_usage(tmp_path) == (5, 500)
    cache.put(OTHER, bytes(1000))
    assert cache.get(OTHER) is None, "the content is larger than the cache"


def test_concurrent_writes_of_one_entry_leave_one_valid_file(tmp_path: Path) -> None:
    content = bytes(range(256)) * 400
    threads = [threading.Thread(target=DiskCache(tmp_path).put, args=(KEY, content)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert DiskCache(tmp_path).get(KEY) == content
    assert [path.name for path in tmp_path.iterdir()] == [KEY]


def test_an_unwritable_folder_disables_the_cache(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    cache = DiskCache(tmp_path / "file" / "c")
    cache.put(KEY, b"content")
    assert cache.get(KEY) is None


def test_an_entry_on_a_read_only_file_system_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    DiskCache(tmp_path).put(KEY, b"content")

    def refuse(*_: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(os, "utime", refuse)
    assert DiskCache(tmp_path).get(KEY) == b"content"
