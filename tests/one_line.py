"""What every refusal must be: one line of the package's own error, in which the place of what is wrong stands."""

from contextlib import contextmanager

import pytest

from cranktrain.core.errors import InputError


@contextmanager
def one_line(*words, kind=InputError):
    """What is done inside is refused by an error of this kind, in one line that holds each of the words."""
    with pytest.raises(kind) as caught:
        yield caught
    said = str(caught.value)
    assert "\n" not in said
    for word in words:
        assert word in said, said
