"""A file is saved as it was, but for what was edited, and never over what somebody else wrote."""

import stat
from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput, UsageError
from simscen.editor.document import NEW, ChangedMeanwhile, Document


@pytest.mark.parametrize("raw", [b"a: 1\nb: 2\n", b"a: 1\r\nb: 2\r\n", b"\xef\xbb\xbfa: 1\nb: 2", "a: ü\n".encode()])
def test_an_unchanged_text_is_saved_byte_for_byte(tmp_path: Path, raw: bytes) -> None:
    file = tmp_path / "a.yaml"
    file.write_bytes(raw)
    document = Document(file, "a.yaml")
    text, version = document.read()
    assert "\r" not in text
    assert document.save(text, version) == version
    assert file.read_bytes() == raw


def test_mixed_line_breaks_are_refused_because_they_could_not_survive(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_bytes(b"a: 1\r\nb: 2\n")
    with pytest.raises(InvalidInput, match="mixes kinds of line breaks"):
        Document(file, "a.yaml").read()


def test_a_file_that_changed_meanwhile_is_kept(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("a: 1\n")
    document = Document(file, "a.yaml")
    _, version = document.read()
    file.write_text("a: 2\n")
    with pytest.raises(ChangedMeanwhile, match="was changed by another program") as refused:
        document.save("a: 3\n", version)
    assert refused.value.content.text == "a: 2\n"
    assert file.read_text() == "a: 2\n"
    document.save("a: 3\n", refused.value.content.version)
    assert file.read_text() == "a: 3\n"


def test_a_new_file_is_not_written_over_one_that_appeared(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    document = Document(file, "a.yaml")
    file.write_text("theirs\n")
    with pytest.raises(ChangedMeanwhile, match="was created"):
        document.save("mine\n", NEW)
    file.unlink()
    version = document.save("mine\n", NEW)
    file.unlink()
    with pytest.raises(ChangedMeanwhile, match="was deleted"):
        document.save("mine\n", version)
    document.save("mine\n", version, overwrite=True)
    assert file.read_text() == "mine\n"


def test_the_permissions_of_the_file_stay(tmp_path: Path) -> None:
    file = tmp_path / "a.yaml"
    file.write_text("a: 1\n")
    file.chmod(0o640)
    document = Document(file, "a.yaml")
    document.save("a: 2\n", document.read().version)
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    assert [one.name for one in tmp_path.iterdir()] == ["a.yaml"]


def test_a_folder_that_is_gone_is_an_error_with_a_reason(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(UsageError, match="cannot be written"):
        Document(blocked / "a.yaml", "a.yaml").save("a: 1\n", NEW)
