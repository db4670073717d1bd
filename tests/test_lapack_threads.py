"""Threads of linear algebra in this process."""

import scipy.linalg  # noqa: F401  # its library is limited once it is loaded
from threadpoolctl import threadpool_info, threadpool_limits

from foldyn.threads import FEW, one_thread


def counts():
    return {one["num_threads"] for one in threadpool_info() if one["internal_api"] == "openblas"}


def test_lapack_has_its_threads_again_when_the_last_one_has_left():
    """Contexts of two threads of a program overlap, and the first to come is the first to leave."""
    one, other = one_thread(), one_thread()
    with threadpool_limits(2, user_api="blas"):
        one.__enter__()
        other.__enter__()
        assert counts() == {1}
        one.__exit__(None, None, None)
        assert counts() == {1}
        other.__exit__(None, None, None)
        assert counts() == {2}


def test_large_matrices_keep_their_threads():
    with threadpool_limits(2, user_api="blas"), one_thread(FEW + 1):
        assert counts() == {2}
