"""The newest wish wins, and nothing waits in a queue."""

from __future__ import annotations

import threading

from foldyn.live.case_session import Newest

SOON = 20.0  # s, in which what must happen has happened


def test_a_wish_is_answered():
    one = Newest(lambda wish: wish + 1)
    assert [one.answer(k) for k in range(4)] == [1, 2, 3, 4]


def test_what_is_computed_for_an_older_wish_is_dropped_and_what_waits_is_forgotten():
    go, begun, computed, answers = threading.Event(), threading.Event(), [], {}

    def compute(wish):
        computed.append(wish)
        begun.set()
        assert go.wait(SOON)
        return wish.upper()

    one = Newest(compute)

    def ask(wish):
        answers[wish] = one.answer(wish)

    threads = {wish: threading.Thread(target=ask, args=(wish,)) for wish in "abc"}
    threads["a"].start()
    assert begun.wait(SOON)
    for wish, older in (("b", "a"), ("c", "b")):
        threads[wish].start()
        threads[older].join(SOON)  # told at once, while "a" is still being computed
        assert answers == dict.fromkeys("ab"[: "abc".index(wish)])
    go.set()
    threads["c"].join(SOON)
    assert answers["c"] == "C"
    assert computed == ["a", "c"]  # "b" never began
