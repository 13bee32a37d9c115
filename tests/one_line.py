"""What every refusal must be: one line of the package's own error, in which the place of what is wrong stands."""

import re
from contextlib import contextmanager

import pytest

from cranktrain.core.errors import InputError


def says(line, words):
    """True if the words stand in the line; " ... " between them stands for any others."""
    return re.search(".*".join(map(re.escape, words.split(" ... "))), line) is not None


@contextmanager
def one_line(*words, kind=InputError, match=None):
    """What is done inside is refused by an error of this kind: one line with all words that matches the pattern."""
    with pytest.raises(kind, match=match) as caught:
        yield caught
    said = str(caught.value)
    assert "\n" not in said
    for word in words:
        assert says(said, word), said
