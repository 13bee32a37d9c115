"""Identification of engines with stated damping: places of data, orders as tables, and what is found."""

import math

import numpy as np

import cranktrain as ct
from cranktrain.core.units import RPM
from cranktrain.engine.file import engine_path
from cranktrain_lab.identification.data import Strand
from cranktrain_lab.identification.model import TorsionalModel
from cranktrain_lab.identification.parameters import sought_parameters
from cranktrain_lab.identification.tables import SoughtTable

RATIOS = 'torsional_ratios = { value = [0.03, 0.03], unit = "1", origin = "chosen" }'


def stated(name, folder):
    """File of a shipped engine with stated damping ratios, so that no level above is run."""
    path, text = folder / f"{name}.toml", engine_path(name).read_text("utf-8")
    path.write_text(text.replace("\n[damping]\n", f"\n[damping]\n{RATIOS}\n"), "utf-8")
    return path


def places(speeds, orders, output="pulley.torsion", deviation=math.nan):
    """Strands without values at speeds (s,), rad/s."""
    still = np.zeros(speeds.size)
    return tuple(
        Strand(output, output, one, speeds, still + 0j, still + deviation, still > 1.0, True) for one in orders
    )


def model_of(engine, keys, data, damper=False, inherit=True):
    """Model of an engine that seeks the values of these keys."""
    sought = sought_parameters(engine, {key: SoughtTable() for key in keys}, [], 1.0)
    return TorsionalModel(engine, data, sought, 1.0, damper, inherit)


def write_orders(path, strands, values, noise=0.0, seed=0, factor=180.0 / math.pi, unit="deg", phases=True):
    """Table of orders as ``cranktrain measured`` writes it; ``noise``: of each order, in units of the values."""
    rng, lines = np.random.default_rng(seed), ["speed_rpm,order,amplitude,unit,phase_deg"]
    for one, own, spread in zip(strands, values, np.broadcast_to(noise, len(strands)), strict=True):
        drawn = own + spread * (rng.normal(size=own.size) + 1j * rng.normal(size=own.size))
        for speed, value in zip(one.speeds, drawn, strict=True):
            phase = f"{math.degrees(np.angle(value)):.5f}" if phases else ""
            lines.append(f"{speed / RPM:.4f},{one.order:g},{factor * abs(value):.9g},{unit},{phase}")
    path.write_text("\n".join(lines) + "\n", "utf-8")


def identified(engine, path, text="", **more):
    """Rows of the parameters by key, and the report, without profiles, bootstrap and levels above."""
    if text:
        path.write_text(text, "utf-8")
    report = ct.identify(engine, path, **{"profile": False, "bootstrap": 0, "above": "none", **more})
    return {row["key"]: row for row in report["parameters"]}, report
