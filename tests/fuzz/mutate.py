"""Random damage to bytes, as by accidents and attackers; reproducible from the generator."""

import random
import re

_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
NUMBERS = [
    b"0", b"-1", b"1e308", b"-1e-308", b"nan", b"inf", b"-inf", b".nan", b".inf", b"1e400", b"4294967296", b"1e30",
    b"9999999999999999999999", b"0x1F", b"007", b"1_000", b"-0.0", b"1e-12", b"65536", b"1000000", b"", b"1 2 3",
]  # fmt: skip
TOKENS = [
    b"{}", b"[]", b"null", b"~", b"true", b"&a", b"*a", b"<<: *a", b"!!python/object:os.system", b"|", b">", b"---",
    b"...", b"\t", b"\x00", b"\xff", b"\xe2\x80\xae", b"\r", b"#", b": ", b"- ", b"'", b'"', b"?", b"%",
    b"../../etc/passwd",
    b"<![CDATA[", b"]]>", b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"&b;", b"<a/>", b"</link>", b"<!--", b"<", b">", b"/>",
    b"xmlns='x'", b"${1/0}", b"${9**9**9}", b"$(env HOME)", b"${'a'*10**9}", b"${[].__class__}", b"$(find x)", b"mm",
    b"deg",
    b"/dev/zero", b"http://x", b"model://", b"\xed\xa0\x80", "ü".encode(), b"a" * 5000, b"[" * 300, b"<a>" * 300,
]  # fmt: skip


def mutant(corpus: list[bytes], rng: random.Random) -> tuple[int, bytes]:
    """Return an index into the corpus and this file, damaged one to six times; 40 % get only other numbers."""
    index = rng.randrange(len(corpus))
    data = corpus[index]
    mutations = _MUTATIONS if rng.random() < 0.6 else (_number,)
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        data = rng.choice(mutations)(data, corpus, rng)
    return index, data[: 1 << 18]


def _span(data: bytes, rng: random.Random) -> tuple[int, int]:
    start = rng.randrange(len(data) + 1)
    return start, min(len(data), start + rng.choice((1, 1, 2, 4, 8, 16, 64, 256)))


def _flip(data: bytes, _: list[bytes], rng: random.Random) -> bytes:
    if not data:
        return data
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]


def _delete(data: bytes, _: list[bytes], rng: random.Random) -> bytes:
    start, end = _span(data, rng)
    return data[:start] + data[end:]


def _cut(data: bytes, _: list[bytes], rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _repeat(data: bytes, _: list[bytes], rng: random.Random) -> bytes:
    start, end = _span(data, rng)
    return data[:end] + data[start:end] * rng.choice((1, 1, 2, 10, 100)) + data[end:]


def _insert(data: bytes, _: list[bytes], rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(TOKENS) + data[at:]


def _overwrite(data: bytes, _: list[bytes], rng: random.Random) -> bytes:
    start, end = _span(data, rng)
    return data[:start] + rng.randbytes(end - start) + data[end:]


def _splice(data: bytes, corpus: list[bytes], rng: random.Random) -> bytes:
    other = rng.choice(corpus)
    return data[: _span(data, rng)[0]] + other[_span(other, rng)[0] :]


def _number(data: bytes, _: list[bytes], rng: random.Random) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return data
    one = rng.choice(found)
    other = rng.choice(NUMBERS) if rng.random() < 0.5 else f"{rng.uniform(-5, 10):.3g}".encode()
    return data[: one.start()] + other + data[one.end() :]


def _line(data: bytes, corpus: list[bytes], rng: random.Random) -> bytes:
    """Delete, repeat, indent, or replace a line."""
    lines = data.split(b"\n")
    at = rng.randrange(len(lines))
    other = rng.choice(rng.choice(corpus).split(b"\n"))
    lines[at : at + 1] = rng.choice(([], [lines[at]] * 2, [other], [lines[at], other], [b"  " + lines[at]]))
    return b"\n".join(lines)


def _word(data: bytes, _: list[bytes], rng: random.Random) -> bytes:
    """Replace one or all occurrences of a word."""
    words = re.findall(rb"\w+", data)
    if not words:
        return data
    return data.replace(rng.choice(words), rng.choice([*words, *NUMBERS, *TOKENS]), rng.choice((1, 1, -1)))


_MUTATIONS = (
    _flip, _delete, _cut, _repeat, _insert, _overwrite, _splice, _number, _number, _number, _line, _line, _word, _word,
)  # fmt: skip
