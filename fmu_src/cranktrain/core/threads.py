"""Threads of linear algebra."""

from threadpoolctl import threadpool_limits


def one_thread() -> threadpool_limits:
    """Context with one thread for linear algebra, which is faster for small blocks and gives reproducible bytes."""
    return threadpool_limits(limits=1, user_api="blas")
