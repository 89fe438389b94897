"""Tests of reading text files, and of files that are refused."""

import os
import signal
import socket
from pathlib import Path

import pytest

from simscen.core.errors import Problem
from simscen.loading.yaml.textfile import read_text


def _problem(path: Path) -> Problem:
    read = read_text(path, "shown.yaml")
    assert isinstance(read, Problem)
    assert read.path == "shown.yaml"
    return read


def _file_with(path: Path, raw: bytes) -> Path:
    path.write_bytes(raw)
    return path


def test_reads_utf8_with_every_kind_of_line_break_and_a_byte_order_mark(tmp_path: Path) -> None:
    file = _file_with(tmp_path / "a.yaml", b"\xef\xbb\xbfa: \xc3\xa9\r\nb: 1\rc: 2\n")
    assert read_text(file, "a.yaml") == "a: é\nb: 1\nc: 2\n"


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    assert _problem(tmp_path / "no.yaml").message == "no such file or directory"


@pytest.mark.parametrize("kind", ["folder", "fifo", "device", "socket"])
def test_special_files_are_refused_without_waiting_for_data(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "x.yaml"
    if kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    elif kind == "device":
        path = Path("/dev/zero")
    else:
        socket.socket(socket.AF_UNIX).bind(str(path))
    signal.signal(signal.SIGALRM, _fail_after_timeout)
    signal.alarm(30)
    try:
        assert _problem(path).message == "not a regular file"
    finally:
        signal.alarm(0)


def _fail_after_timeout(*_) -> None:
    raise AssertionError("it waits for somebody who writes")


@pytest.mark.parametrize(
    "start", [b"P5\n# made by map_saver\n", b"\x89PNG\r\n", b"BM\x36\x10\0\0\0\0\0\0", b"\xff\xd8\xff\xe0"]
)
def test_image_is_recognized_and_refused(tmp_path: Path, start: bytes) -> None:
    hint = "an image, not a text; if it is the image of a map, name the YAML file of the map"
    assert _problem(_file_with(tmp_path / "map.pgm", start + bytes(2 << 20))).message == hint


def test_refuses_a_huge_file_without_reading_it_all(tmp_path: Path) -> None:
    path = tmp_path / "big.yaml"
    with path.open("wb") as file:
        file.truncate(1 << 40)  # no memory holds it
    assert _problem(path).message == "larger than 1 MiB"


def test_a_file_of_exactly_one_mebibyte_is_read(tmp_path: Path) -> None:
    assert isinstance(read_text(_file_with(tmp_path / "full.yaml", b"#" * (1 << 20)), "full.yaml"), str)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_unreadable_file_is_reported(tmp_path: Path) -> None:
    path = _file_with(tmp_path / "secret.yaml", b"a: 1")
    path.chmod(0)
    assert _problem(path).message == "permission denied"


def test_a_loop_of_symbolic_links_is_reported(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").symlink_to(tmp_path / "b.yaml")
    (tmp_path / "b.yaml").symlink_to(tmp_path / "a.yaml")
    assert _problem(tmp_path / "a.yaml").message == "symbolic link loop"


def test_a_byte_that_is_not_utf8_is_reported_with_its_position(tmp_path: Path) -> None:
    problem = _problem(_file_with(tmp_path / "latin1.yaml", b"a: 1\nname: caf" + b"\xe9\n"))
    assert (problem.line, problem.col, problem.message) == (2, 10, "not valid UTF-8 at byte 14")


def test_utf16_is_recognized(tmp_path: Path) -> None:
    problem = _problem(_file_with(tmp_path / "utf16.yaml", "a: 1".encode("utf-16")))
    assert "not valid UTF-8" in problem.message
    assert "UTF-16" in problem.hint


@pytest.mark.parametrize("character", ["\x00", "\x1b", "\x07", "\x7f", "\x85", "\u2028", "\u202e", "\u2066", "\ufffe"])
def test_raw_control_characters_are_refused_at_their_place(tmp_path: Path, character: str) -> None:
    problem = _problem(_file_with(tmp_path / "c.yaml", f"a: 1\nb: x{character}y\n".encode()))
    assert (problem.line, problem.col) == (2, 5)
    assert problem.message == f"control character U+{ord(character):04X}"
