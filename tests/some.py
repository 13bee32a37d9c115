"""Loops of tests that cannot pass on nothing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

Item = TypeVar("Item")


def some(items: Iterable[Item]) -> Iterator[Item]:
    """Yield the items; fail where there is none, because the assertions of a loop over them would not run."""
    count = 0
    for count, item in enumerate(items, 1):  # noqa: B007
        yield item
    assert count, "a loop of this test had nothing to assert on"
