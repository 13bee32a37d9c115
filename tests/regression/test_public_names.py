"""What the last release promised is still there: nothing that a user's script, call or file names was taken away."""

import pytest
from public_names import KINDS, REQUIRED, pinned

NOT_CONSTRUCTED = ("Assembly", "Engine", "Variants")
"""Classes that functions make; their constructors may ask for more."""


@pytest.fixture(scope="module", params=KINDS)
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def present(kind):
    return list(KINDS[kind]())


def test_nothing_is_missing(kind, present):
    """Names, parameters with their defaults, options, variables with causality and unit, keys of files."""
    missing = [line for line in pinned(kind) if line not in set(present)]
    assert not missing, "see docs/public.md on what may be taken away, and when"


def test_no_known_call_needs_more_than_before(kind, present):
    """A parameter that came since has a default."""
    known = set(pinned(kind))
    for line in set(present) - known:
        function = line.partition("(")[0]
        if line.endswith(REQUIRED) and function in known and function not in NOT_CONSTRUCTED:
            raise AssertionError(f"{line}: calls of the last release fail")
