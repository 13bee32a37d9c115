"""Function of the verb ``new``; written by ``python -m cranktrain.cli.library``, not by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from cranktrain.cli.library.calling import call, of_verb

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine


# In one piece: every option of the verb, by keyword.
@of_verb
def new_engine(
    name: str, *,
    layout: Literal["single", "i2", "i3", "i4", "i5", "i6", "i7", "i8", "i9", "i10", "i11", "i12", "v2", "v4", "v6",
        "v6_60", "v6_90", "v8", "v10", "v12", "v16", "boxer2", "boxer4", "boxer6"] | None = None,
    bore_mm: float | None = None, stroke_mm: float | None = None, bank_angle_deg: float | None = None,
    rod_mm: float | None = None, fuel: Literal["petrol", "diesel"] = "petrol", power_kw: float | None = None,
    rated_rpm: float | None = None, damper: Literal["rubber", "viscous"] | None = None,
    flywheel: Literal["solid", "dual-mass"] = "solid", mounts: bool = False, force: bool = False,
    step: str | Path | None = None, main_diameter_mm: float | None = None, pin_diameter_mm: float | None = None,
    mains: int | None = None, pulley_end: str | None = None, thrust_main: int | None = None,
    mesh_size_mm: float | None = None, step_unit: str | None = None,
) -> Engine:  # fmt: skip
    """Write a complete engine file from a layout and a few sizes.

    Raises ``InputError`` for what cannot be used, ``SolverError`` for a computation that fails.

    Parameters
    ----------
    name : of the engine: letters, digits and _; the file is NAME.toml
    layout : of the cylinders: single, i2, i3, i4, i5, i6, i7, i8, i9, i10, i11, i12, v2, v4, v6, v6_60, v6_90, v8, v10,
        v12, v16, boxer2, boxer4, boxer6
    bore_mm : bore, mm
    stroke_mm : stroke, mm
    bank_angle_deg : between the banks of a V, deg
    rod_mm : rod between its eyes, mm (default: 0.3 of it is the throw)
    fuel : petrol or diesel (default petrol)
    power_kw : brake power at the rated speed, kW (default: of the usual mean effective pressure)
    rated_rpm : rated speed, rev/min (default: of the usual mean piston speed)
    damper : torsional damper fitted to the first torsional mode: rubber or viscous (default none)
    flywheel : solid or dual-mass (default solid)
    mounts : with a block and four mounts, for --block flexible
    force : replace an engine file of that name
    step : STEP file (.step, .stp) of the crankshaft alone, in any place and unit; layout and stroke follow from it
    main_diameter_mm : diameter of the main journals, where other cylinders are taken for them
    pin_diameter_mm : diameter of the pins, likewise
    mains : number of main journals, as a check
    pulley_end : end of the pulley in the file's axes: -x, +x, -y, +y, -z or +z (write pulley_end=-z)
    thrust_main : main journal of the thrust bearing (default the middle one)
    mesh_size_mm : largest element edge (default 0.17 of the bore)
    step_unit : unit of the coordinates, where the file states a wrong one: mm, m, in
    """
    return call("new", locals())
