"""What takes long is made once, is made only where it is needed, and says so meanwhile."""

import threading
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_block import single

import cranktrain as ct
from cranktrain.core.cache import cache_folder
from cranktrain.core.errors import InputError, SolverError
from cranktrain.dynamics.simulation import Simulation
from cranktrain.engine.file import load_engine
from cranktrain.engine.parts import NOTHING_PUBLISHED
from cranktrain.fmu.build import build_fmu
from cranktrain.fmu.carried import carried_levels
from cranktrain.fmu.flat import FlatModel
from cranktrain.fmu.parallel_build import made_beside, make_block, make_bores
from cranktrain.fmu.running import chosen_levels
from cranktrain.store import waits as told_waits
from cranktrain.store.hdf5 import save_body
from cranktrain.store.side_by_side import process_context
from cranktrain.structure import assembly
from cranktrain.structure.block import bore as block_bore
from cranktrain.structure.block import reduction as block
from cranktrain.structure.crank import reduction as crank
from cranktrain.structure.crank.level import bare_crank
from cranktrain.structure.crank.torsional import rigid_crank
from cranktrain.structure.in_motion import inherited_damping
from cranktrain.structure.in_motion.inherited_damping import Decay, felt, measured_decay, settings_above


class MeshedError(Exception):
    """Finite elements were asked for."""


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    """An empty cache, and nothing kept in the process."""
    monkeypatch.setenv("CRANKTRAIN_CACHE", str(tmp_path))
    monkeypatch.setattr(assembly, "_KEPT", {})
    return tmp_path


@pytest.fixture
def no_mesh(empty_cache, monkeypatch):
    """An empty cache, and no CAD kernel."""

    def refuse(*_):
        raise MeshedError

    monkeypatch.setattr("cranktrain.structure.fem.mesh.run_in_child", refuse)
    return empty_cache


def other(value):
    """A value near another one, of its type."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, tuple):
        return (other(value[0]), *value[1:]) if value else (1,)
    return value + 1 if isinstance(value, int) else 1.01 * value + 1e-3


def test_a_renamed_engine_has_the_same_crankshaft_and_is_not_meshed(no_mesh, monkeypatch):
    engine = load_engine("diesel_i6")
    with pytest.raises(MeshedError):
        crank.reduced_crankshaft(engine)
    save_body(crank.stored_path(engine), replace(rigid_crank(engine), digest=crank.input_digest(engine)))
    before = sorted(no_mesh.iterdir())
    renamed = replace(engine, name="another", title="Another engine", published=NOTHING_PUBLISHED, load=None)
    assert crank.stored_path(renamed) == crank.stored_path(engine)
    assert np.array_equal(crank.reduced_crankshaft(renamed).shapes, rigid_crank(engine).shapes)
    assert sorted(no_mesh.iterdir()) == before
    assert "diesel" not in crank.stored_path(engine).name


def test_a_crankshaft_kept_by_an_earlier_version_is_read_where_it_is(no_mesh):
    engine = load_engine("diesel_i6")
    old = no_mesh / f"six-{crank.input_digest(engine)[:16]}.h5"
    save_body(old, replace(rigid_crank(engine), digest=crank.input_digest(engine)))
    assert crank.stored_path(engine) == old
    assert crank.reduced_crankshaft(engine).mass == rigid_crank(engine).mass


def test_all_that_shapes_a_crankshaft_is_in_its_key():
    engine = load_engine("diesel_i6")
    own = crank.input_digest(engine)
    keys = {name: [field.name for field in fields(getattr(engine, name))] for name in ("material", "crankshaft")}
    for name, own_keys in (keys | {"reduction": ["fixed_modes", "consistent_mass"]}).items():
        for key in own_keys:
            part = getattr(engine, name)
            changed = replace(engine, **{name: replace(part, **{key: other(getattr(part, key))})})
            assert crank.input_digest(changed) != own, key
    assert crank.input_digest(replace(engine, thrust=replace(engine.thrust, main=1))) != own


def test_all_that_shapes_a_block_is_in_its_key_and_its_heads_are_not():
    engine = load_engine("diesel_i6")
    own = block.input_digest(engine)
    assert block.stored_path(replace(engine, name="x", title="y")) == block.stored_path(engine)
    for field in fields(engine.block):
        changed = replace(engine, block=replace(engine.block, **{field.name: other(getattr(engine.block, field.name))}))
        assert (block.input_digest(changed) == own) == (field.name in block.AFTERWARDS), field.name
    softer = replace(engine.mounts, stiffness_x=tuple(2.0 * k for k in engine.mounts.stiffness_x))
    assert block.input_digest(replace(engine, mounts=softer)) == own
    moved = replace(engine.mounts, x=tuple(1.1 * x for x in engine.mounts.x))
    assert block.input_digest(replace(engine, mounts=moved)) != own


@pytest.mark.slow
def test_the_bore_that_is_kept_beside_the_block_is_that_of_its_own_finite_elements(empty_cache, monkeypatch):
    engine = single()
    alone = block_bore.block_bore_compliance(engine)
    (kept,) = empty_cache.glob("bore-*.npz")
    kept.unlink()
    block.reduced_block(engine, beside=block_bore.bore_beside(engine))
    assert kept.exists()
    monkeypatch.setattr(block_bore, "block_model", lambda *_: pytest.fail("finite elements once more"))
    found = block_bore.block_bore_compliance(replace(engine, name="renamed"))
    assert np.array_equal(found.compliance, alone.compliance)
    assert np.array_equal(found.coefficients, alone.coefficients)


def test_modal_of_a_beam_crank_makes_no_mesh(no_mesh):
    found = ct.modal("single_petrol", crank="beam")
    assert found["compared_with_solid"] is False
    modes = found["cranktrain"]["modes"]
    assert modes == sorted(modes, key=lambda row: row["hz"]) and found["cranktrain"]["first_torsional"]["hz"] > 0.0
    assert found.plot() is not None and not found.to_dataframe().empty
    with pytest.raises(MeshedError):
        ct.modal("single_petrol", crank="solid")


def test_a_beam_crank_stands_beside_the_solid_one_that_is_kept(no_mesh):
    engine = load_engine("single_petrol")
    alone = ct.modal(engine, crank="beam")["cranktrain"]["first_torsional"]["hz"]
    # The beams themselves in place of the solid crank: each mode has its twin.
    save_body(crank.stored_path(engine), replace(bare_crank(engine, "beam"), digest=crank.input_digest(engine)))
    found = ct.modal(engine, crank="beam")
    assert found["compared_with_solid"] is True
    first = found["cranktrain"]["first_torsional"]
    assert first["hz"] == alone and first["solid_hz"] == pytest.approx(alone, rel=1e-12)
    assert all(row["mac"] == pytest.approx(1.0) for row in found["cranktrain"]["modes"])


def test_campbell_and_run_ups_of_beam_cranks_and_the_damping_they_lend_make_no_mesh(no_mesh):
    for name in ("single_petrol", "diesel_v8"):
        assert ct.campbell(name, crank="beam", from_rpm=1500, to_rpm=2000, step_rpm=250).hz.shape[0] == 3
    choices = {"crank": "beam", "workers": 1, "highest_order": 3}
    assert ct.runup("single_petrol", from_rpm=1500, to_rpm=1550, step_rpm=50, **choices).speeds.size == 2
    made = ct.assemble("single_petrol", ct.Settings(crank="torsional"))
    assert made.body.damping.any()


def test_inherited_damping_is_measured_anew_for_what_it_depends_on_alone(no_mesh, monkeypatch):
    measured, decay = [], Decay(np.array([400.0]), np.array([0.02]), 300.0)
    monkeypatch.setattr(inherited_damping, "measured_decay", lambda simulation: measured.append(simulation) or decay)
    engine = load_engine("single_petrol")
    without = replace(engine, limits=None, crank_strength=None, load=None)
    for one in (engine, replace(engine, name="x", title="y"), without):
        assembly.running_crank(one, "torsional")
    assert len(measured) == 1
    pistons = replace(engine, cylinders=replace(engine.cylinders, piston_mass=1.01 * engine.cylinders.piston_mass))
    assembly.running_crank(pistons, "torsional")
    assert len(measured) == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["single_petrol", "diesel_v8"])
def test_what_is_left_out_of_the_key_changes_no_bit_of_the_damping(name):
    engine = load_engine(name)
    found = []
    for one in (felt(engine), replace(engine, drive_line_chain=None)):
        made = assembly.assemble(one, settings_above("beam"))
        found.append(measured_decay(Simulation(one, made.body, made.settings, parts=made.parts)))
    assert np.array_equal(found[0].ratio, found[1].ratio) and np.array_equal(found[0].hz, found[1].hz)


def test_an_fmu_carries_slow_levels_on_demand_or_where_it_starts_at_them():
    six, v8 = load_engine("diesel_i6"), load_engine("diesel_v8")
    assert carried_levels(six) == frozenset()
    assert carried_levels(six, "all") == {"table", "flexible"}
    assert carried_levels(six, "table") == carried_levels(six, ["usual", "table"]) == {"table"}
    assert "flexible" in carried_levels(v8)  # its rollers run in the flexible block
    assert "flexible" not in carried_levels(replace(six, block=None), "all")
    with pytest.raises(InputError, match="flexible"):
        carried_levels(six, "flexibel")


@pytest.mark.parametrize(
    ("keywords", "chosen"),
    [({}, {"block", "films"}), ({"levels": "all"}, {"film_table", "flexible", "block", "films"}),
     ({"levels": "flexible"}, {"flexible", "block", "films"}), ({"film_table": False}, {"flexible", "block", "films"}),
     ({"film_table": False, "block": False}, {"films"}), ({"levels": "basic"}, {"block"})],
)  # fmt: skip
def test_keywords_choose_the_data_of_an_fmu(monkeypatch, tmp_path, keywords, chosen):
    asked = []
    monkeypatch.setattr("cranktrain.fmu.build.whole_model",
                        lambda engine, *_, **given: asked.append(given) or FlatModel(engine, {}))  # fmt: skip
    monkeypatch.setattr("cranktrain.fmu.build.build", lambda *_, **__: tmp_path / "made.fmu")
    build_fmu("diesel_i6", tmp_path, platforms=(), **keywords)
    assert {name for name in ("film_table", "flexible", "block", "films") if asked[0][name]} == chosen


@pytest.mark.parametrize("chosen", [{"block": "flexible"}, {"bearings": "table"}])
def test_a_level_that_an_fmu_does_not_carry_is_refused_with_the_way_to_get_it(chosen):
    engine = load_engine("diesel_i6")
    model = FlatModel(engine, {"solid": rigid_crank(engine)})
    with pytest.raises(InputError, match=r"built without .*build_fmu\.py --levels all"):
        chosen_levels(model, chosen, {})


def test_a_short_step_is_not_told_and_a_long_one_is(monkeypatch):
    said, heard = [], threading.Event()

    def line(text):
        said.append(text)
        heard.set()

    with told_waits.waits("six", line) as told:
        told.tell("short")
        told.tell("also short")
    assert said == []
    monkeypatch.setattr(told_waits, "LATE", 0.0)
    with told_waits.waits("six", line) as told:
        told.tell("long")
        assert heard.wait(60.0)
    assert said == ["six: long"]
    with told_waits.waits("run", line) as told:  # a share is told now and then
        told.follow(0.2)
        monkeypatch.setattr(told_waits, "AGAIN", -1.0)
        told.follow(0.4)
        told.follow(1.0)
    assert said[1:] == ["run: 40 %"]


def test_processes_start_without_a_thread_beside_them_and_what_they_do_is_told():
    said, before = [], process_context().get_start_method()
    with told_waits.waits(line=said.append) as told:
        told.tell("slabs")
        assert process_context().get_start_method() == before
    assert said == ["slabs"]


def test_kernels_that_compile_for_long_in_all_are_told_once(monkeypatch):
    """Kernels within another one count with it; the first second is silent."""
    said, now = [], [0.0]
    told = told_waits.Waits(line=said.append)
    listener = told_waits._Compiled(told)
    monkeypatch.setattr(told_waits, "time", SimpleNamespace(monotonic=lambda: now[0]))
    begin, end = (SimpleNamespace(is_start=start, is_end=not start) for start in (True, False))
    for name in ("start", "join"):  # the clock is this test's
        monkeypatch.setattr(told_waits.threading.Timer, name, lambda self: None)

    def compiled(seconds):
        for event in (begin, begin, end):
            listener.notify(event)
        now[0] += seconds
        listener.notify(end)

    for seconds, count in ((0.6, 0), (0.6, 1), (5.0, 1)):
        compiled(seconds)
        assert len(said) == count
    assert "compiling kernels" in said[0]


@pytest.mark.parametrize("verb", ["campbell", "assemble"])
def test_functions_of_the_library_tell_long_steps(empty_cache, monkeypatch, capsys, verb):
    monkeypatch.setattr(told_waits, "LATE", 0.0)
    if verb == "campbell":
        ct.campbell("single_petrol", crank="beam", from_rpm=1500, to_rpm=2000, step_rpm=250)
    else:
        ct.assemble("single_petrol", ct.Settings(crank="beam"))
    assert "single_petrol: " in capsys.readouterr().err


def leave_a_file(engine):
    (cache_folder() / f"{engine.name}.txt").write_text("made")


def fail(engine):
    raise SolverError(engine.name)


@pytest.mark.parametrize("count", [1, 2])
def test_a_part_made_beside_is_in_the_cache_and_its_errors_are_left_to_the_build(empty_cache, monkeypatch, count):
    """With one processor the build makes it itself: nothing is made beside."""
    monkeypatch.setattr("cranktrain.fmu.parallel_build.processors", lambda: count)
    engine, said = load_engine("single_petrol"), []
    with made_beside(leave_a_file, engine, "file", said.append) as wait:
        wait()
    assert (empty_cache / "single_petrol.txt").exists() == (count > 1)
    with made_beside(fail, engine, "failure", said.append) as wait:
        wait()
    with pytest.raises(InputError), made_beside(leave_a_file, engine, "file", said.append):
        raise InputError("the crankshaft")


def test_the_process_beside_makes_what_the_build_then_asks_for(empty_cache, monkeypatch):
    """Each part is one that the build reads from the cache by the same call."""
    made = []
    for name in ("running_block", "elastic_bore", "big_end_bore"):
        monkeypatch.setattr(assembly, name, lambda engine, *, _name=name, **given: made.append((_name, given)))
    make_bores(load_engine("diesel_i6"))
    assert made == [("big_end_bore", {}), ("elastic_bore", {"flexible": False})]
    made.clear()
    make_block(load_engine("diesel_v8"))
    assert made == [("running_block", {"tilting": True, "bore": False})]  # rollers need no bore
