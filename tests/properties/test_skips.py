"""Skips are told by kind, and a reason that nobody listed is seen."""

import skips


def test_reasons_are_told_by_their_start():
    known, unknown = skips.kinds(["needs gcc on Linux", "needs gcc on Linux", "needs clang", "the moon is full"])
    assert known == {"needs gcc": 2, "needs clang": 1} and unknown == {"the moon is full": 1}


def test_a_start_is_no_part_of_another():
    """Else the first in the table would take the other's tests."""
    assert not [(a, b) for a in skips.KNOWN for b in skips.KNOWN if a != b and a.startswith(b)]
