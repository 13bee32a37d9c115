"""What messages propose: all missing keys at once, remedies that were not given already, names of the same kind."""

import re
import warnings
from pathlib import Path

import msgspec
import pytest
from docs.engine_keys_page import page

from cranktrain.cli.functions import verb_of
from cranktrain.cli.main import _parser, main
from cranktrain.cli.parser import function_of, question
from cranktrain.cli.result_names import result_name
from cranktrain.cli.verbs import FUNCTIONS
from cranktrain.core.errors import InputError, nearest
from cranktrain.dynamics.outputs.register import nearest_output, output_counts, output_names
from cranktrain.engine.additions import TABLES as ADDITIONS
from cranktrain.engine.entries import stated
from cranktrain.engine.file import engine_folder, engine_parts, engine_table, load_engine
from cranktrain.engine.model import Engine, optional_fields, parts
from cranktrain.engine.parts import Damper
from cranktrain.engine.torsional_chain import Disc, Shaft, read_chain, row_keys
from cranktrain.studies.design.layouts import LAYOUTS

SIX = (engine_folder() / "diesel_i6.toml").read_text(encoding="utf-8")
RUBBER = 'kind = { value = "rubber", origin = "chosen" }\n'
RING = 'ring_inertia = { value = 0.1, unit = "kg m^2", origin = "chosen" }\n'


def told(tmp_path, tables):
    """Message for the six with other tables at its end, in place of its own ones of these names."""
    text = SIX
    for name in re.findall(r"^\[(\w+)\]", tables, re.MULTILINE):
        text = re.sub(rf"^\[{name}\]\n(?:(?!^\[).*\n?)*", "", text, flags=re.MULTILINE)
    path = tmp_path / "six.toml"
    path.write_text(text + "\n" + tables, encoding="utf-8")
    with pytest.raises(InputError) as caught, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        load_engine(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def keys(message):
    assert "missing;" in message and "degC" not in message
    return set(re.findall(r"'(\w+)'", message.partition(" missing;")[0]))


OF_RUBBER = {
    "mass", "frequency", "lowest_temperature", "highest_temperature", "temperature_speeds", "temperatures",
    "ambient_temperature", "heat_transfer", "cooling_area", "power_limit", "stiffness", "loss_factor",
}  # fmt: skip


@pytest.mark.parametrize(
    ("tables", "wanted"),
    [
        (f"[damper]\n{RUBBER}", OF_RUBBER | {"ring_inertia"}),
        (f"[damper]\n{RUBBER}{RING}", OF_RUBBER),
        ('[load]\nkind = { value = "power", origin = "chosen" }\n', {"speed", "power"}),
        ("[piston_guidance]\n", parts.PistonGuidance),
        ("[mounts]\n", parts.Mounts),
        ("[block]\n", parts.Block),
    ],
)
def test_every_table_names_all_its_missing_keys(tmp_path, tables, wanted):
    if not isinstance(wanted, set):
        wanted = set(wanted.__dataclass_fields__) - optional_fields(wanted)
    assert keys(told(tmp_path, tables)) == wanted and {"damper", "block", "mounts"} <= optional_fields(Engine)


@pytest.mark.parametrize(
    ("shaft", "wanted"),
    [
        ("", {"between"}), ("frequencies = [5, 50]\ndamping = 3", {"between", "stiffness", "frequency"}),
        ("twists = [0, 0.1]", {"between", "torques"}), ("torques = [1, 2]", {"between", "stiffness"}),
    ],
)  # fmt: skip
def test_rows_of_a_drive_line_name_all_their_missing_keys(tmp_path, shaft, wanted):
    path = tmp_path / "line.toml"
    path.write_text(f"[[shaft]]\n{shaft}\n")
    with pytest.raises(InputError) as caught:
        read_chain(path)
    assert keys(str(caught.value)) == wanted
    path.write_text("[[disc]]\ndamping = 1.0\n")
    with pytest.raises(InputError, match=r"disc 1: keys 'name', 'inertia' are missing; add them"):
        read_chain(path)


STATIONS = 'stations = { value = [0, 9], unit = "mm", origin = "chosen" }\n'
ROD = 'motion = "rod"\n'
RIGID = {"mass", "inertia", "centre", "interfaces", "x", "y", "z"}
DAMPER = 'kind = { value = "viscous", origin = "chosen" }\n'


@pytest.mark.parametrize(
    ("table", "given", "wanted"),
    [
        ("body", "", RIGID),
        ("body", 'interfaces = ["a"]\n', RIGID - {"interfaces"}),
        ("body", STATIONS, {"interfaces", "z", "diameters"}),
        ("body", STATIONS + 'along = "y"\ndiscs = ["a"]\n',
         {"interfaces", "y", "z", "diameters", "disc_masses", "disc_polar", "disc_diametral"}),
        ("frame", ROD, {"pin", "length"}),
        ("connection", 'ends = ["crank.flywheel", "ground"]\nlaw = "belt"\n',
         {"radius", "stiffness", "damping", "tension"}),
        ("connection", 'law = "damper"\n' + DAMPER,
         {"ends", *Damper.needed({"kind": "viscous"}.get).keys} - {"mass", "ambient_temperature", "heat_transfer",
                                                                  "cooling_area", "power_limit"}),
    ],
)  # fmt: skip
def test_tables_of_arrays_name_all_their_missing_keys(tmp_path, table, given, wanted):
    assert keys(told(tmp_path, f'[[{table}]]\nname = "own"\n{given}')) - {"own"} == wanted


def test_the_page_of_keys_is_what_the_readers_take():
    """Every key of every table of the readers is on the page, with what makes it necessary, and no other."""
    text = (Path(__file__).parents[2] / "docs" / "engine_keys.md").read_text(encoding="utf-8")
    assert text == page(), "run: python docs/engine_keys_page.py docs/engine_keys.md"
    found = re.findall(r"^## ([^\n,]+)[^\n]*\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    row = re.compile(r"^\| `(\w+)` \|.*\| (yes|no|by kind) \|$", re.MULTILINE)
    rows = {head: dict(row.findall(own)) for head, own in found}
    read = {f"[{name}]": stated(part, "") for name, part in engine_parts().items()}
    arrays = msgspec.inspect.type_info(engine_table()).fields
    for entry in arrays:
        if entry.encode_name in ADDITIONS:
            tables = next(kind for kind in entry.type.types if hasattr(kind, "item_type")).item_type
            for one in getattr(tables, "types", (tables,)):
                law = f" of law {one.tag}" if one.tag else ""
                read[f"[[{entry.encode_name}]]{law}"] = one.cls
    for head, table in read.items():
        required = {entry.encode_name: entry.required for entry in msgspec.inspect.type_info(table).fields}
        assert {key: word == "yes" for key, word in rows.pop(head).items()} == required, head
    for head, kind, needed in (("[[disc]]", Disc, ("name", "inertia")), ("[[shaft]]", Shaft, ("between",))):
        own = rows.pop(head)
        assert {key for key, word in own.items() if word == "yes"} == set(needed)
        assert set(own) == set(row_keys(kind))
    assert not rows


def test_an_output_is_proposed_of_its_own_family_and_another_case_is_nearer_than_another_letter():
    for word, meant in (("I4", "i4"), ("V6_60", "v6_60"), ("i14", "i4")):
        assert nearest(word, LAYOUTS) == f"did you mean '{meant}'?"
    four = output_names(output_counts(load_engine("single_petrol")))
    assert nearest_output("mount[1].force.y", four) == "the engine of this run has no mounts"
    assert nearest_output("bearing[9].force.y", four) == "did you mean 'bearing[2].force.y'?"
    assert nearest_output("pulley.torson", four) == "did you mean 'pulley.torsion'?"


def test_remedies_name_what_was_given_and_nothing_else(capsys):
    assert main(["couple", "two_stroke_six", "--speed", "100", "--no-valvetrain"]) == 2
    assert "--no-valvetrain" not in (said := capsys.readouterr().err) and "--pressure" in said
    assert main(["couple", "single_petrol", "--speed", "2000"]) == 2
    assert "--no-valvetrain" in capsys.readouterr().err or "combustion" in said


OTHER = {
    "simulate": ("--crank torsional", "--bearings linear", "--big-ends impedance", "--block flexible", "--damper",
                 "--pistons guided", "--load 0.5", "--cycles 2", "--cycles 3", "--settle 1e-4", "--mesh a.msh",
                 "--mesh b.msh", "--pressure a.csv", "--pressure a.csv --pressure-unit bar", "--pressure x/a.csv:2,3",
                 "--integrator esdirk4", "--step-deg 1", "--tolerance 1e-4", "--load-torque-nm 30", "--no-inherit",
                 "--axial-force-n 9", "--film-temperature heat-balance", "--encoder pulley",
                 f"--drive-line {'x' * 300}.csv", f"--drive-line {'x' * 301}.csv", "--mesh a.msh --mesh-unit mm"),
    "stress": ("--big-ends impedance", "--load 0.5", "--settle 1e-4", "--no-check"),
    "couple": ("--cycles 2", "--scheme jacobi", "--step-deg 2", "--no-valvetrain", "--set cranktrain.a=1",
               "--set cranktrain.a=2"),
}  # fmt: skip


@pytest.mark.parametrize("verb", OTHER)
def test_results_of_other_options_have_other_names(verb):
    """Every option that the verb has and that changes a result is in its file's name; what changes none is not."""
    known = verb_of(function_of(FUNCTIONS[verb]))

    def name(given):
        options = _parser(verb).parse_args([verb, "diesel_i6", "--speed", "2000", *given.split()])
        return result_name("diesel_i6", question(known, options))

    names = [name(given) for given in ("", *OTHER[verb], " ".join(OTHER[verb][:4]))]
    assert len(set(names)) == len(names)
    assert names[0] == "diesel_i6_2000rpm.h5" == name("--json --output other.h5")
    assert all(re.fullmatch(r"[\w.+-]+\.h5", one) and len(one) < 140 for one in names)
