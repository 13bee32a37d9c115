"""Bodies in open formats and superelements of other programs: what goes out comes back, what is given counts."""

import json
import re
from dataclasses import fields, replace

import numpy as np
import pytest
import superelements as texts
from one_line import one_line
from refusals import refused_files
from scipy.linalg import eigh
from small_block import single
from superelements import DENSITY, DIAMETER, LENGTH, E, G, shaft, write_superelement

from cranktrain.cli.main import main
from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.reduced_body import ReducedBody, attach, rigid_coordinates
from cranktrain.engine.file import load_engine
from cranktrain.fmu.build import crank_levels
from cranktrain.store.bodies import export_body, import_body
from cranktrain.structure.assembly import running_crank
from cranktrain.structure.block.reduction import reduced_block, running_block
from cranktrain.structure.crank.beam import beam_body, crank_frame
from cranktrain.structure.crank.reduction import complete_crankshaft as attached
from cranktrain.structure.crank.reduction import own_crankshaft
from cranktrain.structure.fem.frame import circular
from cranktrain.structure.fem.own_body import is_body, read_body

FORMS = ("body.h5", "body.npz", "body")
FIRST = {"start": 0, "end": -1}


@pytest.fixture(scope="module")
def made():
    """A body with an unbalanced part, damping, records and quality."""
    body = shaft(8).reduced("shaft", "abc", {"a": 0, "b": 8}, 12)
    body = attach(body, "b", 0.1, np.diag([1e-5, 1e-5, 2e-5]), (0.01, 0.0, 0.0))
    damping = np.linspace(1.0, 2.0, body.n_modes)
    return replace(body, damping=damping, records={"one": np.arange(3.0), "two": np.eye(2)}, quality={"error": 1e-3})


@pytest.mark.parametrize("form", FORMS)
def test_a_body_comes_back_as_it_went(tmp_path, made, form):
    """Also written over itself, and without damping or records."""
    for body in (made, replace(made, damping=np.zeros(0), records={}, basis=None)):
        found = import_body(export_body(tmp_path / form, body))
        for field in fields(ReducedBody):
            mine, theirs = getattr(body, field.name), getattr(found, field.name)
            if isinstance(mine, np.ndarray):
                size = np.abs(mine).max(initial=0.0)
                assert mine.shape == theirs.shape and np.abs(mine - theirs).max(initial=0.0) <= 1e-12 * size, field.name
            elif field.name == "records":
                assert mine.keys() == theirs.keys() and all(np.array_equal(mine[k], theirs[k]) for k in mine)
            else:
                assert mine == theirs, field.name
    assert is_body(tmp_path / form) and [one.name for one in tmp_path.iterdir()] == [form]


def test_matrix_market_files_are_the_equations_of_motion(tmp_path, made):
    """Whoever reads them finds the frequencies: K φ = ω² M φ."""
    from scipy.io import mmread

    export_body(tmp_path / "body", made)
    stiffness, mass = (mmread(tmp_path / "body" / f"{name}.mtx").toarray() for name in ("stiffness", "mass"))
    squares = eigh(stiffness, mass, eigvals_only=True)
    assert np.allclose(np.sqrt(squares[6:]), np.sort(made.omega[6:]), rtol=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_a_torn_body_is_refused_in_one_line(tmp_path, capsys, made, form):
    path = export_body(tmp_path / form, made)
    torn = path / "shapes.mtx" if path.is_dir() else path
    whole = torn.read_bytes()
    torn.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(StoreError, match="damaged"):
        import_body(path)
    assert main(["reduce", "diesel_i6", "--body", str(path), "--output", str(tmp_path / "other.npz")]) == 2
    told = capsys.readouterr().err.splitlines()
    assert "damaged" in told[-1] and not (tmp_path / "other.npz").exists()


def test_only_bodies_are_replaced(tmp_path, made):
    for form in ("body.h5", "body.npz"):
        (tmp_path / form).write_bytes(b"not ours")
        with pytest.raises(InputError, match="exists and is no"):
            export_body(tmp_path / form, made)
        assert (tmp_path / form).read_bytes() == b"not ours"
    export_body(tmp_path / "body", made)
    (tmp_path / "body" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="holds more than a reduced body"):
        export_body(tmp_path / "body", made)
    assert (tmp_path / "body" / "notes.txt").exists()
    with pytest.raises(InputError, match=r"\.h5 or \.npz file, or a folder"):
        export_body(tmp_path / "body.xlsx", made)


def test_a_shaft_in_abaqus_text_has_the_free_frequencies_of_a_shaft(tmp_path):
    """Slender: 4.7300, 7.8532 (Euler and Bernoulli); torsion and stretch √(G/ρ)/2L and √(E/ρ)/2L."""
    body = read_body(write_superelement(tmp_path, shaft(24), {"start": 1, "end": 25}))
    bending = np.array([4.730041, 7.853205]) ** 2 * np.sqrt(E * DIAMETER**2 / 16.0 / DENSITY) / LENGTH**2
    found = np.sort(body.omega[6:])
    assert np.allclose(found[:4], np.repeat(bending, 2), rtol=2e-3)
    for wave in (np.sqrt(G / DENSITY), np.sqrt(E / DENSITY)):
        assert np.abs(found / (np.pi * wave / LENGTH) - 1.0).min() < 1e-3
    assert body.mass == pytest.approx(DENSITY * np.pi / 4.0 * DIAMETER**2 * LENGTH, rel=1e-9)


def test_every_form_of_matrices_gives_the_same_body(tmp_path):
    """Abaqus matrix input, CalculiX rows and columns, millimetres and tonnes, nodes from *NODE lines."""
    frame, interfaces = shaft(4), {"start": 1, "end": 5}
    stiffness, mass = frame.matrices()
    wanted = read_body(write_superelement(tmp_path, frame, interfaces))
    nodes = list(range(1, 6))
    size = np.tile([1e3, 1e3, 1e3, 1.0, 1.0, 1.0], 5)  # mm in a metre: q in mm and rad
    in_mm = [1e3 * matrix / np.outer(size, size) for matrix in (stiffness, mass)]
    for name, matrix in zip(("k", "m"), in_mm, strict=True):
        texts.matrix_input(tmp_path / f"{name}.mtx", nodes, matrix)
        texts.rows_and_columns(tmp_path / f"{name}.sti", matrix)
    (tmp_path / "rows.dof").write_text("".join(f"{node}.{c}\n" for node in nodes for c in range(1, 7)))
    places = zip(nodes, 1e3 * np.array(frame.positions), strict=True)
    lines = [f"{node}, {x:.1f}, {y:.1f}, {z:.6f}" for node, (x, y, z) in places]
    (tmp_path / "part.inp").write_text("*HEADING\nshaft\n*NODE, NSET=all\n" + "\n".join(lines) + "\n*ELEMENT\n1, 2\n")
    head = 'nodes = "part.inp"\nunits = "mm-t-s"\n'
    tail = "[interfaces]\nstart = 1\nend = 5\n"
    (tmp_path / "a.toml").write_text(f'stiffness = "k.mtx"\nmass = "m.mtx"\n{head}{tail}')
    (tmp_path / "b.toml").write_text(f'stiffness = "k.sti"\nmass = "m.sti"\ndofs = "rows.dof"\n{head}{tail}')
    for name in ("a.toml", "b.toml"):
        found = read_body(tmp_path / name)
        assert np.allclose(found.omega, wanted.omega, rtol=1e-8)
        assert np.allclose(found.positions, wanted.positions) and np.allclose(found.inertia, wanted.inertia, rtol=1e-8)


def test_averaged_nodes_of_a_solid_move_as_their_mean_rigid_motion(tmp_path):
    """Three nodes fixed round an end follow it; without rotations of their own they still tell its six motions."""
    frame = shaft(4)
    for x, y in ((0.02, 0.0), (-0.01, 0.017), (-0.01, -0.017)):
        frame.beam(4, frame.node((x, y, LENGTH)), circular(0.02, DENSITY, 0.3))
    path = write_superelement(tmp_path, frame, {"start": 1, "end": 5, "ring": "[6, 7, 8]"})
    body = read_body(path)
    ring, end = body.index("ring"), body.index("end")
    assert np.allclose(body.positions[ring], (0.0, 0.0, LENGTH))
    mine, theirs = body.shapes[ring][:, :12], body.shapes[end][:, :12]
    assert np.allclose(mine, theirs, atol=2e-2 * np.abs(theirs).max())


def rotation_terms(body):
    columns = body.centrifugal_load[:, None], body.euler_load[:, None]
    return body.gyroscopic, body.centrifugal, *columns, body.translation.T


def test_in_rigid_motion_the_terms_of_rotation_are_exact(tmp_path):
    """Unbalanced, off the axis, with seven nodes only: as of the frame, whose slices are its own."""
    frame = shaft(4)
    for node, place in ((1, (0.1, 0.02, 0.3)), (3, (-0.05, 0.08, 0.8))):
        frame.beam(node, frame.node(place), circular(0.03, DENSITY, 0.3))
    wanted = frame.reduced("shaft", "", {"start": 0, "end": 4}, 18)
    found = read_body(write_superelement(tmp_path, frame, {"start": 1, "end": 5}))
    turn = np.linalg.solve(rigid_coordinates(wanted), rigid_coordinates(found))
    assert np.allclose(turn, np.eye(6), atol=1e-9)
    for mine, theirs in zip(rotation_terms(found), rotation_terms(wanted), strict=True):
        size = np.abs(theirs[:6, :6]).max()
        assert np.allclose(mine[:6, :6], theirs[:6, :6], rtol=0.0, atol=1e-8 * size)
    # What holds for any body: momentum of elastic modes is none, and turning about z is neutral.
    assert np.abs(found.translation[:, 6:]).max() < 1e-8 and np.abs(found.euler_load[6:]).max() < 1e-8
    neutral = (found.stress_stiffness - found.centrifugal)[5]
    assert np.abs(neutral).max() < 1e-8 * np.abs(found.centrifugal).max()


def test_what_the_slices_miss_vanishes_with_the_square_of_the_spacing(tmp_path):
    errors = []
    for elements in (8, 16, 32):
        body = read_body(write_superelement(tmp_path, shaft(elements), {"start": 1, "end": elements + 1}))
        first = np.abs(np.diag(body.centrifugal)[6:8] - 1.0)  # a bending mode across z: ∫ρ (e_z×φ)² = 1
        errors.append(first.max())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] < 5e-3 and np.all(rates > 1.7), (errors, rates)


def craig_bampton(stiffness, mass, kept, modes):
    """Matrices in the kept rows and so many fixed-interface modes, and the basis."""
    rest = np.setdiff1d(np.arange(len(mass)), kept)
    inner, across = np.ix_(rest, rest), np.ix_(rest, kept)
    basis = np.zeros((len(mass), len(kept) + modes))
    basis[kept, np.arange(len(kept))] = 1.0
    basis[rest, : len(kept)] = -np.linalg.solve(stiffness[inner], stiffness[across])
    basis[rest, len(kept) :] = eigh(stiffness[inner], mass[inner])[1][:, :modes]
    return basis.T @ stiffness @ basis, basis.T @ mass @ basis


def test_fixed_interface_modes_count_as_modal_coordinates(tmp_path):
    """Three retained nodes and 18 modes: two nodes without a place, as generalized coordinates are written."""
    frame = shaft(24)
    stiffness, mass = frame.matrices()
    kept = np.concatenate([6 * node + np.arange(6) for node in (0, 12, 24)])
    condensed = craig_bampton(stiffness, mass, kept, 18)
    nodes = [1, 13, 25, 9001, 9002, 9003]
    texts.user_element(tmp_path / "super.mtx", nodes, dict(zip(("STIFFNESS", "MASS"), condensed, strict=True)))
    places = {node: frame.positions[node - 1] for node in nodes[:3]}
    files = {"matrices": "super.mtx"}
    body = read_body(texts.describe(tmp_path / "super.toml", places, {"start": 1, "end": 25}, files))
    full = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[6:14])
    assert np.allclose(body.omega[6:14], full, rtol=1e-3)
    assert body.quality["slice_mass_error"] > 0.1  # and the body says that rotation does not see all of it


def clamped(stiffness, mass):
    """The last node is clamped away."""
    return stiffness[:-6, :-6], mass[:-6, :-6]


NOT_FREE = [
    (lambda k, m: (k + np.diag([1e7] + [0.0] * 29), m), r"rigid motion is resisted .* most at node 1"),
    (lambda k, m: (k, np.diag(np.diag(m) * np.tile([1.0, 1.0, 3.0, 1.0, 1.0, 1.0], 5))), "not a rigid body's"),
    (lambda k, m: (k, m - np.diag(np.r_[np.zeros(24), np.diag(m)[24:]])), "mass"),
    (clamped, "give consistent or lumped mass of the whole free body"),
]


@pytest.mark.parametrize(("spoil", "says"), NOT_FREE)
def test_matrices_of_no_free_body_are_refused_with_what_would_serve(tmp_path, spoil, says):
    frame = shaft(4)
    matrices = spoil(*frame.matrices())
    frame.positions[len(matrices[0]) // 6 :] = []
    path = write_superelement(tmp_path, frame, {"start": 1, "end": len(frame.positions)}, matrices)
    with one_line(match=says):
        read_body(path)


@pytest.mark.parametrize(("file", "pattern", "new", "says"), refused_files()["superelement"]["changes"])
def test_a_superelement_that_cannot_be_used_is_refused_with_what_would_serve(tmp_path, file, pattern, new, says):
    """A description that does not fit the matrices, or a text that is cut short."""
    frame = shaft(4)
    path = write_superelement(tmp_path, frame, {"start": 1, "end": 5})
    if file == "s.pch":
        texts.punch(tmp_path / file, dict(zip(("KAAX", "MAAX"), frame.matrices(), strict=True)))
        path = texts.describe(path, dict(enumerate(frame.positions, 1)), {"start": 1, "end": 5}, {"matrices": file})
    text = (tmp_path / file).read_text()
    assert re.search(pattern, text)
    (tmp_path / file).write_text(re.sub(pattern, new, text))
    with one_line(match=says):
        read_body(path)


@pytest.fixture(scope="module")
def crank(tmp_path_factory):
    """The six's crankshaft of beams as another program would hand it over, uncondensed."""
    engine = load_engine("diesel_i6")
    frame, nodes = crank_frame(engine)
    folder = tmp_path_factory.mktemp("crank")
    return engine, write_superelement(folder, frame, {name: node + 1 for name, node in nodes.items()})


def test_a_crankshaft_of_beams_comes_back_from_its_matrices(crank):
    """Against the beams' own body, which is reduced (its frequencies lie above) and knows where its mass is.

    The stress of the centrifugal load is what is left out: its share in the frequencies at 2000 rev/min is bounded.
    """
    engine, path = crank
    found, wanted = own_crankshaft(engine, path), beam_body(engine)
    low = slice(0, int(np.count_nonzero(wanted.frequencies_hz < 1000.0)))
    assert low.stop > 12 and found.quality["slice_mass_error"] < 2e-3
    ratio = found.omega[6 : low.stop] / wanted.omega[6 : low.stop]
    assert np.all(ratio < 1.0 + 1e-9) and np.all(ratio > 0.999)
    at = [found.index(name) for name in wanted.interfaces]
    mine, theirs = found.shapes[at][:, :, low], wanted.shapes[:, :, low]
    signs = np.sign(np.einsum("iak,iak->k", mine, theirs))
    assert np.abs(mine * signs - theirs).max() < 2e-3 * np.abs(theirs).max()
    both = np.ix_(range(low.stop), range(low.stop))

    def difference(term):
        mine, theirs = getattr(found, term), getattr(wanted, term)
        turned = signs[:, None] * mine[both] * signs if mine.ndim == 2 else signs * mine[low]
        return turned - (theirs[both] if mine.ndim == 2 else theirs[low])

    assert np.abs(difference("gyroscopic")).max() < 1e-3 and np.abs(difference("centrifugal")).max() < 3e-3
    for load in ("centrifugal_load", "euler_load"):
        assert np.abs(difference(load)).max() < 2e-3 * np.abs(getattr(wanted, load)).max()
    speed = 2000.0 * np.pi / 30.0
    shift = 0.5 * speed**2 * np.diag(difference("stress_stiffness"))[6:] / wanted.omega[6 : low.stop] ** 2
    assert np.abs(shift).max() < 2e-3


def test_a_crankshaft_of_another_engine_is_refused(crank):
    with pytest.raises(InputError, match=r"no interface named|lies at"):
        own_crankshaft(load_engine("diesel_v8"), crank[1])


def test_the_command_takes_a_superelement_and_writes_it_as_a_body(crank, tmp_path, capsys):
    made = str(tmp_path / "crank.npz")
    assert main(["reduce", "diesel_i6", "--body", str(crank[1]), "--output", made, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["output"] == made and told["path"] == str(crank[1])
    assert main(["modal", "diesel_i6", "--body", made, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["reduction"]["modes"] == told["modes"]


def test_an_fmu_has_the_users_crank_at_all_levels_but_the_beams(crank):
    engine, path = crank
    engine = replace(engine, reduction=replace(engine.reduction, torsional_source="solid"))
    own, wanted = crank_levels(engine, path), own_crankshaft(engine, path)
    assert own["solid"].mass == pytest.approx(attached(engine, wanted).mass, rel=1e-12)
    assert own["rigid"].mass == pytest.approx(own["solid"].mass, rel=1e-9)
    # a torsional crank of the solid body: its first mode is that of the solid on rods, locked
    assert own["torsional"].frequencies_hz[6] > 100.0
    assert np.array_equal(own["beam"].omega, running_crank(engine, "beam").omega)


@pytest.fixture(scope="module")
def small_block():
    return reduced_block(single())


@pytest.mark.parametrize("form", FORMS)
def test_a_block_comes_back_as_it_went(tmp_path, small_block, form):
    path = export_body(tmp_path / form, small_block)
    found = reduced_block(single(), path)
    assert found.interfaces == small_block.interfaces
    assert found.omega == pytest.approx(small_block.omega, rel=1e-12)
    own, made = (running_block(single(), body) for body in (found, small_block))
    assert own.omega == pytest.approx(made.omega, rel=1e-9, abs=1e-3)


def test_a_block_of_another_engine_is_refused(tmp_path, small_block, capsys):
    path = export_body(tmp_path / "block.npz", small_block)
    with pytest.raises(InputError, match=r"no interface named bore\[3\].*name a node of each bore"):
        reduced_block(load_engine("diesel_v8"), path)
    centre, far = small_block.centre, small_block.centre + 0.05
    steiner = (far @ far - centre @ centre) * np.eye(3) - np.outer(far, far) + np.outer(centre, centre)
    inertia = small_block.inertia + small_block.mass * steiner
    moved = replace(small_block, positions=small_block.positions + 0.05, centre=far, inertia=inertia)
    with pytest.raises(InputError, match="the engine file has it at"):
        reduced_block(single(), export_body(path, moved))
    flexible = ["simulate", "diesel_i6", "--speed", "2000", "--block", "flexible", "--block-body", str(path)]
    assert main([*flexible, "--bearings", "ehd"]) == 2
    assert "need the shapes of the block's bores" in capsys.readouterr().err
