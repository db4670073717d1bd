"""Pairs tied by friction stay in pair lists, wherever these are made.

A Newton step may lead far away before it is shortened, and lists are made on the way.
"""

from __future__ import annotations

import numpy as np

from foldyn.jit.compiled import inner, kernel
from foldyn.mechanics.contact.pairs import VERTEX, gap_of
from foldyn.mechanics.contact.planes import LEAST


@kernel
def take_ties(memory):
    """Kind, parts (m, 3), d0 and tie (m, 5) of all tied pairs."""
    count = 0
    for go in range(2):
        if go == 1:
            parts, ties = np.empty((count, 3), np.int64), np.empty((count, 5))
        count = 0
        for kind in range(2):
            listed = memory.counts.listed_first if kind == VERTEX else memory.counts.listed_second
            for k in range(listed):
                if memory.tie[kind, k, 2] == 0.0:
                    continue
                if go == 1:
                    parts[count, 0] = kind
                    pair, tie = memory.pairs[kind, k], memory.tie[kind, k]
                    parts[count, 1], parts[count, 2] = pair[0], pair[1]
                    ties[count, 0] = memory.d0[kind, k]
                    for c in range(tie.size):
                        ties[count, 1 + c] = tie[c]
                count += 1
    return parts, ties


@kernel
def lay_ties(memory, parts, ties):
    """Make a list of the pairs from `take_ties` only, which the next list takes over."""
    counts = memory.counts
    counts.has_list = counts.listed_first = counts.listed_second = 0
    for m in range(len(parts)):
        kind = parts[m, 0]
        k = counts.listed_first if kind == VERTEX else counts.listed_second
        memory.pairs[kind, k, 0], memory.pairs[kind, k, 1] = parts[m, 1], parts[m, 2]
        memory.d0[kind, k] = ties[m, 0]
        for c in range(ties.shape[1] - 1):
            memory.tie[kind, k, c] = ties[m, 1 + c]
        if kind == VERTEX:
            counts.listed_first = k + 1
        else:
            counts.listed_second = k + 1


@inner
def put_ties(tables, memory, parts, ties, loose, found):
    """Tie pairs of a new list, of found[kind] pairs, as `take_ties` returned them.

    Missing pairs are added and counted in `found`; `loose`: whether to include pairs that did not
    touch. New lists are ordered by triangles and first edges.
    """
    for kind in range(2):
        memory.tie[kind, : found[kind], 2:] = 0.0
    fresh = found[0], found[1]
    for m in range(len(parts)):
        kind = parts[m, 0]
        pairs, key = memory.pairs[kind], 1 if kind == VERTEX else 0
        k, last = _begin(pairs, key, parts[m, 1 + key], fresh[kind]), fresh[kind]
        while k < last and pairs[k, key] == parts[m, 1 + key]:
            if pairs[k, 1 - key] == parts[m, 2 - key]:
                break
            k += 1
        if k == last or pairs[k, key] != parts[m, 1 + key]:
            if ties[m, 3] <= LEAST and not loose:
                continue
            k = found[kind]
            if k == len(pairs):
                found[kind] = len(pairs) + 1  # no room
                return
            found[kind] += 1
            pairs[k, 0], pairs[k, 1], memory.d0[kind, k] = parts[m, 1], parts[m, 2], ties[m, 0]
            gap = gap_of(
                tables.triangles, tables.edges, memory.x, kind, parts[m, 1], parts[m, 2]
            )  # fmt: skip
            memory.gap[kind, k] = gap - ties[m, 0]
        for c in range(ties.shape[1] - 1):
            memory.tie[kind, k, c] = ties[m, 1 + c]


@inner
def _begin(pairs, key, value, count):
    """First of the pairs (m, 2), ordered by column `key`, whose key is at least `value`."""
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if pairs[middle, key] < value:
            low = middle + 1
        else:
            high = middle
    return low
