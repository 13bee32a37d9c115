"""Names before the first release: an old verb, option or keyword ends with one line that has the present one."""

import pytest

import cranktrain as ct
from cranktrain.cli.functions import verb_of
from cranktrain.cli.main import main
from cranktrain.cli.parser import function_of
from cranktrain.cli.verbs import FORMER, FUNCTIONS, VERBS

KNOWN = {verb: verb_of(function_of(place)) for verb, place in FUNCTIONS.items()}
RENAMED = [(verb, one) for verb, known in KNOWN.items() for one in known.fields if one.option.was]
LISTED = {
    "--out": "--output", "--jobs": "--workers", "--rebuild": "--anew", "--level": "--method", "--load": "--load-n",
    "--speeds": "--from", "--pictures": "--results", "--steady": "--method", "--step": "--cad",
    "--step-unit": "--cad-unit", "--no-damper": "--damper",
}  # fmt: skip


def test_every_renamed_option_is_known():
    assert {one.option.was: one.names[0] for _, one in RENAMED} == LISTED


@pytest.mark.parametrize(("verb", "one"), RENAMED, ids=lambda value: value if isinstance(value, str) else value.name)
@pytest.mark.parametrize("values", [("x",), ("800", "2400"), ()])
def test_an_old_option_names_the_new_one(verb, one, values, capsys):
    first = ["diesel_i6"] if KNOWN[verb].subject is not None else []
    assert main([*verb.split(), *first, one.option.was, *values]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and one.option.was in error
    assert f"{one.names[0]} now" in error or f"give {one.names[0]} for" in error


@pytest.mark.parametrize("verb", FORMER)
def test_an_old_verb_names_the_new_one(verb, capsys):
    assert verb not in VERBS and FORMER[verb].partition(" ")[0] in {name.partition(" ")[0] for name in VERBS}
    assert main([verb, "diesel_i6"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and f"cranktrain {FORMER[verb]}" in error


def test_old_keywords_and_functions_name_the_new_ones():
    with pytest.raises(ct.InputError, match="'steady' is called 'method' now"):
        ct.runup("diesel_i6", from_rpm=1000, to_rpm=2000, steady="linear")
    with pytest.raises(ct.InputError, match="'jobs' is called 'workers' now"):
        ct.film_table(length_ratio=0.5, jobs=2)
    with pytest.raises(AttributeError, match="it is called identify now"):
        ct.calibrate  # noqa: B018


def test_a_damper_is_fitted_where_it_is_asked_for():
    """One default: every verb leaves the damper out."""
    found = {verb: one.default for verb, known in KNOWN.items() for one in known.fields if one.name == "damper"}
    del found["new"]  # a kind of damper to be made
    assert len(found) > 7 and set(found.values()) == {False}
