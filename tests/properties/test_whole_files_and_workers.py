"""Files appear whole or not at all, and tasks give the same side by side as one after the other."""

import pytest

from cranktrain.store.side_by_side import side_by_side
from cranktrain.store.whole_file import whole_file


def square(number, tell=None):
    """A task that may say how far it is."""
    if tell:
        tell(number, 1.0)
    return number**2


@pytest.mark.parametrize("workers", [1, 2])
def test_every_task_comes_with_its_result(workers):
    assert sorted(side_by_side(square, [(3,), (1,), (2,)], workers)) == [((1,), 1), ((2,), 4), ((3,), 9)]


@pytest.mark.parametrize("workers", [1, 2])
def test_what_tasks_tell_is_heard(workers):
    told = []
    list(side_by_side(square, [(1,), (2,)], workers, lambda *report: told.append(report)))
    assert sorted(told) == [(1, 1.0), (2, 1.0)]


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_of_a_task_reaches_its_caller(workers):
    with pytest.raises(TypeError):
        list(side_by_side(square, [("a",), ("b",), ("c",)], workers))


def test_a_broken_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "new" / "a.txt"
    with whole_file(path) as temporary:
        temporary.write_text("first")
    with pytest.raises(ValueError, match="broken"), whole_file(path) as temporary:
        temporary.write_text("second")
        raise ValueError("broken")
    assert path.read_text() == "first"
    assert [file.name for file in path.parent.iterdir()] == ["a.txt"]
