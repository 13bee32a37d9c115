r"""Flat binary with the running model's data: the engine and its reduced crankshafts, readable without HDF5.

Layout (little-endian)::

    0   8 bytes   magic, b"CRNKTRN\0"
    8   uint32    schema
    12  uint32    0
    16  uint64    length of the header in bytes, a multiple of 8
    24  uint64    number of float64 values that follow the header
    32  32 bytes  SHA-256 of header and values
    64            header: JSON, padded with spaces
                  values: float64 arrays in C order, at the offsets (in values) that the header gives

The header contains ``engine`` (SI, from :func:`cranktrain.engine.model.engine_to_dict`), ``bodies`` with their names
(``cranks.solid``, ``damped.solid``, ``block``), the data other than arrays of ``table``, ``big_end_table``,
``film_tables.0`` …, ``bore``, ``block_bore``, ``big_end_bore`` and ``gas``, and ``arrays`` (name, shape, offset). All
but the engine may be absent. Equal data give equal bytes. A body's records, basis and quality are left out, because
they serve reports only.
"""

import hashlib
import json
import struct
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.reduced_body import SCHEMA as BODY_SCHEMA
from cranktrain.core.reduced_body import ReducedBody
from cranktrain.engine.model import Engine, engine_from_dict, engine_to_dict
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.table.database import FilmTable, TableSettings
from cranktrain.film.table.interpolation import TableArrays
from cranktrain.loads.gas_pressure import GasTrace

MAGIC = b"CRNKTRN\0"
SCHEMA = 10
_PREFIX = struct.Struct("<8sIIQQ32s")
_ARRAYS = (
    "omega",
    "positions",
    "shapes",
    "gyroscopic",
    "centrifugal",
    "stress_stiffness",
    "centrifugal_load",
    "euler_load",
    "translation",
    "centre",
    "inertia",
    "damping",
)
_BODIES = ("cranks", "damped", "added")
_TABLES = ("table", "big_end_table")
_ADDED_TABLE = "film_tables."
"""Prefix of the names of added film tables; the table's number follows."""
_BORES = ("bore", "block_bore", "big_end_bore")
_ERRORS = ("aligned_error", "tilted_error")
_SHAPES = ("coefficients", "compliance", "load_coupling", "captured")
_GAS = "gas."
"""Prefix of the names of a measured trace's arrays; the cylinder's number follows, or nothing if all share a trace."""


class FlatModel(NamedTuple):
    """Contents of a flat binary.

    ``cranks`` are crankshafts by crank level; ``damped`` are the same with the damper's housing on the pulley. ``gas``
    is a measured pressure trace in place of the engine's own. ``added`` are shafts and bodies from files that the
    engine adds, by name; ``film_tables`` belong to its added films. ``bore`` includes its rigid motion, on ground; for
    ``block_bore`` this motion is in the modes of a flexible block.
    """

    engine: Engine
    cranks: Mapping[str, ReducedBody]
    damped: Mapping[str, ReducedBody] = MappingProxyType({})
    table: FilmTable | None = None
    bore: BoreCompliance | None = None
    big_end_table: FilmTable | None = None
    block: ReducedBody | None = None
    block_bore: BoreCompliance | None = None
    added: Mapping[str, ReducedBody] = MappingProxyType({})
    film_tables: tuple[FilmTable, ...] = ()
    big_end_bore: BoreCompliance | None = None
    gas: GasTrace | None = None


def to_bytes(model: FlatModel) -> bytes:
    """Bytes of the model in the layout of this module; ``StoreError`` if a value is not finite."""
    bodies = {f"{kind}.{level}": body for kind in _BODIES for level, body in getattr(model, kind).items()}
    if model.block is not None:
        bodies["block"] = model.block
    named = {f"{key}.{name}": getattr(body, name) for key, body in bodies.items() for name in _ARRAYS}
    tables = {key: getattr(model, key) for key in _TABLES}
    tables |= {f"{_ADDED_TABLE}{k}": films for k, films in enumerate(model.film_tables)}
    for key, films in tables.items():
        if films is not None:
            named |= {f"{key}.{name}": array for name, array in films.arrays._asdict().items()}
            named |= {f"{key}.{name}": getattr(films, name) for name in _ERRORS}
    bores = {key: getattr(model, key) for key in _BORES}
    named |= {f"{key}.{name}": getattr(bore, name) for key, bore in bores.items() if bore for name in _SHAPES}
    # An empty key is for a trace common to all cylinders, else it is the cylinder's number (from 1).
    traces = {} if model.gas is None else {"": model.gas} | {str(k): own for k, own in enumerate(model.gas.own, 1)}
    named |= {f"{_GAS}{k}.{what}": getattr(trace, what) for k, trace in traces.items() for what in ("motored", "fired")}
    arrays, values, offset = [], [], 0
    for name, given in named.items():
        array = np.ascontiguousarray(given, dtype="<f8")
        if not np.isfinite(array).all():
            raise StoreError(f"{model.engine.name}: '{name}' holds values that are not finite; make it again")
        arrays.append({"name": name, "shape": list(array.shape), "offset": offset})
        values.append(array.tobytes())
        offset += array.size
    header = {
        "engine": engine_to_dict(model.engine),
        "bodies": [
            {"part": key, "schema": BODY_SCHEMA, "name": body.name, "interfaces": list(body.interfaces),
             "mass": float(body.mass), "digest": body.digest}
            for key, body in bodies.items()
        ],
        **{key: None if films is None else asdict(films.settings) for key, films in tables.items()},
        **{key: None if bore is None else {"area": bore.area} for key, bore in bores.items()},
        "gas": {k: [one.imep, one.best_speed, one.falloff, one.source] for k, one in traces.items()},
        "arrays": arrays,
    }  # fmt: skip
    text = json.dumps(header, sort_keys=True, separators=(",", ":"), ensure_ascii=True).encode()
    text += b" " * (-len(text) % 8)
    content = text + b"".join(values)
    return _PREFIX.pack(MAGIC, SCHEMA, 0, len(text), offset, hashlib.sha256(content).digest()) + content


def from_bytes(data: bytes, name: str = "model") -> FlatModel:
    """Flat model from bytes, the inverse of :func:`to_bytes`.

    Raises ``StoreError``: foreign data, another schema, or data truncated or changed since they were written.

    Parameters
    ----------
    data : the bytes
    name : name of the data for messages
    """
    remedy = "build the FMU again with build_fmu.py"
    if len(data) < _PREFIX.size or data[:8] != MAGIC:
        raise StoreError(f"{name}: not a flat model of cranktrain; {remedy}")
    _, schema, _, n_header, n_values, digest = _PREFIX.unpack_from(data)
    if schema != SCHEMA:
        raise StoreError(f"{name}: schema {schema}, this cranktrain reads schema {SCHEMA}; {remedy}")
    content = data[_PREFIX.size :]
    if len(content) != n_header + 8 * n_values or hashlib.sha256(content).digest() != digest:
        raise StoreError(f"{name}: truncated or changed since it was written (digest differs); {remedy}")
    header = json.loads(content[:n_header])
    values = np.frombuffer(content, dtype="<f8", offset=n_header).astype(np.float64)
    arrays: dict[str, Any] = {}
    for entry in header["arrays"]:
        size = int(np.prod(entry["shape"]))
        array = values[entry["offset"] : entry["offset"] + size].reshape(entry["shape"]).copy()
        arrays[entry["name"]] = array
    parts: dict[str, Any] = {kind: {} for kind in _BODIES}
    for about in header["bodies"]:
        part = about["part"]
        if about["schema"] != BODY_SCHEMA:
            raise StoreError(f"{name}: {part} of schema {about['schema']}, not {BODY_SCHEMA}; {remedy}")
        body = ReducedBody(
            name=about["name"],
            interfaces=tuple(about["interfaces"]),
            mass=about["mass"],
            digest=about["digest"],
            **{key: arrays[f"{part}.{key}"] for key in _ARRAYS},
        )
        kind, _, level = part.partition(".")
        if level:
            parts[kind][level] = body
        else:
            parts[kind] = body
    added = sorted((key for key in header if key.startswith(_ADDED_TABLE)), key=lambda key: int(key.rpartition(".")[2]))
    for key in (*_TABLES, *added):
        if header[key] is not None:
            data_of = {field: arrays[f"{key}.{field}"] for field in TableArrays._fields}
            data_of["tilted"] = data_of["tilted"].astype(np.float32)
            errors = [arrays[f"{key}.{field}"] for field in _ERRORS]
            parts[key] = FilmTable(TableSettings(**header[key]), TableArrays(**data_of), *errors)
    parts["film_tables"] = tuple(parts.pop(key) for key in added)
    for key in _BORES:
        if header[key] is not None:
            data_of = {field: arrays[f"{key}.{field}"] for field in _SHAPES}
            parts[key] = BoreCompliance(**data_of, area=header[key]["area"])
    traces = {
        k: GasTrace(arrays[f"{_GAS}{k}.motored"], arrays[f"{_GAS}{k}.fired"], *about)
        for k, about in header["gas"].items()
    }
    if traces:
        parts["gas"] = replace(traces.pop(""), own=tuple(traces[k] for k in sorted(traces, key=int)))
    try:
        engine = engine_from_dict(header["engine"])
    except InputError as error:
        raise StoreError(f"{name}: {error}; {remedy}") from None
    return FlatModel(engine, **parts)


def read_model(path: str | Path) -> FlatModel:
    """Read a flat model; ``StoreError`` if it is missing, corrupt or foreign."""
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise StoreError(f"{path}: cannot be read ({error.strerror}); build the FMU again with build_fmu.py") from None
    return from_bytes(data, path.name)
