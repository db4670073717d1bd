"""Mutations of bytes and of the words of a text, drawn from a seeded generator."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Sequence
from random import Random

LONGEST = 1 << 20
"""Bytes beyond which an input does not grow."""

INTEGERS = [0, 1, -1, *(s * 2**n + d for n in (7, 8, 15, 16, 31, 32, 63, 64)
                        for s in (1, -1) for d in (-1, 0, 1))]  # fmt: skip
REALS = [0.0, -0.0, 5e-324, 1e-300, 1e103, 1e154, 1e308, 1.7976931348623157e308,
         float("inf"), float("-inf"), float("nan")]  # fmt: skip
WORDS = [
    *map(str, INTEGERS), *map(repr, REALS), "1e400", "1" + "0" * 400, "9" * 4400, "0x" + "f" * 40,
    "1_000", "1,5", "NaN", "Infinity", "true", "false", "null", "None", '""', '"\\u0000"', "\x00",
    "é", "\u202e", "\U0001f4a9", "[]", "{}", "()", "[[]]", "[", "]", "{", "}", "(", ")", ",", ":",
    ";", "=", ".", "-", "+", "#", '"', "'", "\\", "\n", "\r", "\t", " ", "..", "../..",
]  # fmt: skip
"""Words at the bounds of what texts hold."""
_PIECES = re.compile(rb"[A-Za-z_]\w*|[-+]?\d[\d.eE+-]*|\s+|[^\w\s]|.", re.DOTALL)


def mutate(random: Random, data: bytes, seeds: Sequence[bytes], words: Sequence[str]) -> bytes:
    """Damaged copy of `data`: words of the format count where there are any, else bytes."""
    for _ in range(random.choice((1, 1, 1, 2, 3, 6))):
        if words and random.random() < 0.7:
            data = _words(random, data, seeds, words)
        else:
            data = _bytes(random, data, seeds)
        data = data[:LONGEST]
    return data


def _bytes(random: Random, data: bytes, seeds: Sequence[bytes]) -> bytes:
    start, end = _range(random, len(data))
    return random.choice(_OF_BYTES)(random, data, start, end, random.choice(seeds))


def _range(random: Random, length: int) -> tuple[int, int]:
    """A piece, short more often than long."""
    start = random.randint(0, length)
    longest = random.choice((1, 4, 16, 256, length))
    return start, min(length, start + random.randint(0, max(longest, 1)))


def _flip(random: Random, data: bytes, start: int, end: int, other: bytes) -> bytes:
    mutated = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 8))):
        if mutated:
            mutated[random.randrange(len(mutated))] ^= 1 << random.randrange(8)
    return bytes(mutated)


def _cut(random: Random, data: bytes, start: int, end: int, other: bytes) -> bytes:
    return data[:start] + data[end:]


def _end(random: Random, data: bytes, start: int, end: int, other: bytes) -> bytes:
    return data[:start]


def _insert(random: Random, data: bytes, start: int, end: int, other: bytes) -> bytes:
    return data[:start] + random.randbytes(random.choice((1, 2, 8, 64))) + data[start:]


def _again(random: Random, data: bytes, start: int, end: int, other: bytes) -> bytes:
    times = random.choice((1, 2, 10, 1000))
    times = max(1, min(times, LONGEST // max(1, end - start)))
    return data[:end] + data[start:end] * times + data[end:]


def _swap(random: Random, data: bytes, start: int, end: int, other: bytes) -> bytes:
    far = random.randint(end, len(data))
    return data[:start] + data[end:far] + data[start:end] + data[far:]


def _blank(random: Random, data: bytes, start: int, end: int, other: bytes) -> bytes:
    return data[:start] + random.choice((b"\0", b"\xff", b" ")) * (end - start) + data[end:]


def _splice(random: Random, data: bytes, start: int, end: int, other: bytes) -> bytes:
    first, last = _range(random, len(other))
    return data[:start] + other[first:last] + data[end:]


def _number(random: Random, data: bytes, start: int, end: int, other: bytes) -> bytes:
    """A boundary number over what was there, in the machine's forms."""
    if random.random() < 0.3:
        put = struct.pack("<d", random.choice(REALS))
    else:
        size = random.choice((1, 2, 4, 8))
        number = random.choice(INTEGERS) % (1 << 8 * size)
        put = number.to_bytes(size, random.choice(("little", "big")))
    return data[:start] + put + data[start + len(put) :]


_OF_BYTES: list[Callable[[Random, bytes, int, int, bytes], bytes]] = [
    _flip, _cut, _end, _insert, _again, _swap, _blank, _splice, _number,
]  # fmt: skip


def _words(random: Random, data: bytes, seeds: Sequence[bytes], words: Sequence[str]) -> bytes:
    pieces = _PIECES.findall(data) or [b""]
    i, j = random.randrange(len(pieces)), random.randrange(len(pieces))
    kind = random.choice(("word", "bound", "piece", "cut", "swap", "again", "deep", "line"))
    if kind == "word":
        pieces[i] = random.choice(list(words)).encode()
    elif kind == "bound":
        numbers = [k for k, piece in enumerate(pieces) if piece[-1:].isdigit()]
        pieces[random.choice(numbers or [i])] = random.choice(WORDS).encode()
    elif kind == "piece":
        pieces[i] = pieces[j]
    elif kind == "cut":
        del pieces[i]
    elif kind == "swap":
        pieces[i], pieces[j] = pieces[j], pieces[i]
    elif kind == "again":
        repeated = pieces[i : i + random.randint(1, 6)]
        many = min(random.choice((2, 3, 30, 1000)), LONGEST // (sum(map(len, repeated)) + 1))
        pieces[i : i + 1] = repeated * many
    elif kind == "deep":
        opened, closed = random.choice(((b"[", b"]"), (b"{", b"}"), (b"(", b")"), (b"-", b"")))
        depth = random.choice((1, 2, 100, 100000))
        pieces[i] = opened * depth + pieces[i] + closed * depth
    else:
        lines = data.splitlines(keepends=True) or [b""]
        i, j = random.randrange(len(lines)), random.randrange(len(lines))
        lines[i : i + random.randint(0, 1)] = [lines[j]]
        return b"".join(lines)
    return b"".join(pieces)
