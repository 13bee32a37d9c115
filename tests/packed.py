"""Packed models compared array by array; the names of arrays that such tests know are here, all others in entry.py."""

import re

import numpy as np

FROM_NUMBERS = {"scalars", "choices", "stages", "gas", "cylinders"}
"""Arrays that hold numbers of a run which its structure leaves open."""
OF_STRUCTURE = re.compile(r"basis\.trace_rows$|basis\.cylinders$")
"""Arrays that tell what a model was made for."""
NOT_OF_LUMPS = re.compile(r"lumps\.|.*numbers$|.*\.out$|layout$|bodies\.gyroscopic$")
"""Arrays that lumped data are made from, scratch of laws, and what differs where modes may turn."""
SHAPES = ("tilts", "ends", "shafts", "gravity", "bodies.centrifugal_load", "bodies.euler_load")
"""Arrays whose last axis is that of modes, whose signs are free."""
LEAST = {"bodies.spin": 1.0, "bodies.centrifugal_load": 1e-3}
"""Sizes of arrays, in modes of unit mass, that are zero but for rounding where journals are locked on their axis."""


def arrays(record, left_out=OF_STRUCTURE, name=""):
    """All arrays of a model by name, but for addresses and those that are ``left_out``."""
    for field, value in zip(record._fields, record, strict=True):
        own = f"{name}{field}"
        if isinstance(value, tuple):
            yield from arrays(value, left_out, f"{own}.")
        elif value.dtype == np.float64 and not left_out.match(own):
            yield own, value


def signs(found, wanted):
    """Sign of each turning mode of one model in the other's."""
    rows = np.abs(wanted.ports).argmax(axis=0), np.arange(wanted.ports.shape[1])
    return np.where(found.ports[rows] * wanted.ports[rows] < 0.0, -1.0, 1.0)


def with_signs(name, one, sign, ports):
    """An array of a model with other signs of its turning modes, which have ``ports`` rows of shapes."""
    n, one = sign.size, one.copy()
    if name in SHAPES:
        one[..., :n] *= sign
    elif name == "bodies.shapes":
        one[:ports, :n] *= sign
    elif name == "bodies.transposed":
        one[:n] *= sign[:, None]
    elif name == "bodies.spin":
        one[:n, :n] *= np.outer(sign, sign)
    return one


def differences(found, wanted, tolerance=1e-9):
    """Names of the arrays that differ for other lumped data, with their relative difference."""
    sign, ports, result = signs(found, wanted), len(wanted.ports), {}
    for (name, one), (_, other) in zip(arrays(found, NOT_OF_LUMPS), arrays(wanted, NOT_OF_LUMPS), strict=True):
        one = with_signs(name, one, sign, ports)
        size = max(np.abs(other).max(initial=0.0), LEAST.get(name, 0.0))
        if not np.allclose(one, other, rtol=0.0, atol=tolerance * size):
            result[name] = np.abs(one - other).max() / size
    return result
