"""What a fuzzer needs to know of a reader."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

from fuzz_mutations import mutate

Mutator = Callable[[Random, bytes, Sequence[bytes]], bytes]
"""From a seed, and all seeds to take pieces of, to a damaged one."""


@dataclass(frozen=True)
class Target:
    """A reader of ours, and sound input from which damaged input is made.

    Parameters
    ----------
    name : str
    seeds : callable
        Makes sound inputs, all of which the reader must accept. It is given the folder in which
        inputs will lie, for other files that they name.
    read : callable
        Reads one input from its file: to succeed or to raise `InputError`, nothing else.
    suffix : str
        Of the input's file.
    words : sequence of str
        Words that the format knows, put in the place of others; none: bytes are mutated only.
    mutate : callable
        Another mutator.
    """

    name: str
    seeds: Callable[[Path], Sequence[bytes]]
    read: Callable[[Path], object]
    suffix: str = ""
    words: tuple[str, ...] = ()
    mutate: Mutator | None = None

    def mutated(self, seed: int, number: int, seeds: Sequence[bytes]) -> bytes:
        """Damaged input of a number: always the same one."""
        random = Random(f"{self.name} {seed} {number}")
        chosen = random.choice(seeds)
        if self.mutate is not None:
            return self.mutate(random, chosen, seeds)
        return mutate(random, chosen, seeds, self.words)
