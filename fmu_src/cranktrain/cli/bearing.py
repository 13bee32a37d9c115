"""The verb ``bearing``: one plain bearing, by its eccentricity (dimensionless) or by its load (in units)."""

from __future__ import annotations

import argparse
import math
import statistics
import time
from collections.abc import Callable
from typing import Any

from cranktrain.cli.console import number, of_words, one_of, positive, show_rows
from cranktrain.core.errors import InputError
from cranktrain.engine.file import load_engine
from cranktrain.engine.oil_grades import COOL, EXPANSION, GRADES, HOT
from cranktrain.engine.quantities import OIL_GRADES

SURFACES = (
    "roughness_um", "roughness_pattern", "asperity_factor", "asperity_density", "asperity_ratio", "asperity_radius_um",
    "contact_modulus_gpa", "hardness_mpa", "boundary_friction", "boundary_shear_mpa",
)  # fmt: skip
GIVEN = ("length_ratio", "eccentricity", "squeeze", "squeeze_only", "tilt")
HEAT = (
    "inlet_temperature_c",
    "oil_viscosity_40",
    "oil_viscosity_100",
    "oil_density",
    "heat_share",
    "film_temperature",
    "carry_over",
    "oil_grade",
)
LOADED = (
    "diameter_mm", "width_mm", "clearance_um", "viscosity", "speed", "load", "moment_nm", "grooves", "groove_deg",
    *HEAT, *SURFACES, "pressure_law", "pressure_viscosity", "compressibility", "bore",
)  # fmt: skip
UNITS = (*LOADED[:5], *HEAT)
NEEDED = {"eccentricity": ("length_ratio",), "load": LOADED[:5], "place": LOADED[:5]}
FOREIGN = {"eccentricity": LOADED, "load": GIVEN, "place": ("load", "moment_nm", "grooves", "groove_deg", *GIVEN[2:])}
OIL_DENSITY = 860.0
TIMED_RUNS, TIMED_SECONDS = 15, 0.02

DESCRIPTION = """\
One plain bearing: load, attitude, flow, friction, stiffness and damping.

Oil is at ambient pressure at both ends.

By eccentricity: --length-ratio, --eccentricity; dimensionless results, x along the eccentricity, y 90 deg ahead in the
sense of rotation, with B width, D diameter, R = D/2, c radial clearance, psi = c/R, eta viscosity, omega speed of the
journal in a bore at rest:
  sommerfeld   So = F psi^2/(B D eta omega); with --squeeze-only So = F psi^2/(B D eta |deps/dt|)
  attitude_deg angle from the load to the eccentricity, in the sense of rotation
  side_flow    Q/(R^3 psi omega), Q the flow that pressure drives out of both ends together
  friction     mu_f/psi = S/(2 So) + eps sin(attitude)/2, S = half the integral of dphi dzeta/H over a filled gap
               (2 pi/sqrt(1 - eps^2) without tilt); friction of the journal, 0 for the shear of --squeeze-only
  p_max        p psi^2/(eta omega)
  force        [x, y] F psi^2/(B D eta omega) on the journal
  moment       [x, y] M psi^2/(B^2 D eta omega), the moment vector on the journal about its middle
With --squeeze-only omega stands for deps/dt in all these norms. attitude_deg and friction are null without load.
seconds: wall time of the solution alone, with kernels loaded (median of up to 15 runs).

By load: --diameter-mm, --width-mm, --clearance-um (radial), --viscosity (Pa s), --speed (rev/min), --load (N); x along
the load, y 90 deg ahead in the sense of rotation: eccentricity (over c), attitude_deg, min_film_um, stiffness (N/m) and
damping (N s/m) as rows of 2 x 2 matrices -dF/dx and -dF/dx', whirl_threshold omega_s sqrt(c m/W) of a rigid rotor with
mass m per bearing (null: stable at every speed, 0: at no speed), flow (m^3/s, out of both ends), friction_torque (N m,
on the journal, of a filled gap), p_max (Pa), seconds (equilibrium and coefficients, as above). With --moment-nm the
matrices are 4 x 4 for (x, y, dx/dz, dy/dz) against (Fx, Fy, My, -Mx), and the result has tilt, the displacement of the
axis at the end z = +B/2 over c.

With --inlet-temperature-c instead of --viscosity the oil is Walther's (ASTM D341) through its kinematic viscosities at
40 and 100 degC (--oil-viscosity-40, --oil-viscosity-100, mm^2/s) with --oil-density (kg/m^3), or the typical oil of
--oil-grade. A heat balance gives the temperature: --heat-share of the friction power warms the oil that leaves at the
ends (2000 J/(kg K)) from inlet to outlet, and the viscosity is that at their mean. The result has
effective_temperature_c, outlet_temperature_c and viscosity (Pa s) too.

With --film-temperature adiabatic (and --cavitation mass-conserving) the oil warms along the circumference by its own
friction, one temperature over gap and width, and its viscosity follows. --heat-share is 1 unless given: nothing passes
into journal and bore. At the supply the oil that comes round, --carry-over of it, mixes with fresh oil. The result has
supply_mixture_temperature_c, largest_temperature_c at largest_temperature_deg (from the load, in the sense of
rotation), outlet_temperature_c, heat (W), and film_temperature_c over film_angle_deg. Stiffness and damping are at this
temperature field.

--roughness-um (standard deviation sigma of both surfaces together) adds flow factors (Patir and Cheng; isotropic, or
stretched by --roughness-pattern along the motion) and asperities that carry (Greenwood and Tripp) and rub. They are
given by --asperity-factor (eta beta sigma) or --asperity-density (eta), --asperity-ratio (sigma/beta) or
--asperity-radius-um (beta), --contact-modulus-gpa, --hardness-mpa of the softer surface, --boundary-friction and
--boundary-shear-mpa (on the area that truly touches); the defaults are those of the engine files. contact_load (N),
contact_friction_torque (N m), contact_pressure_max_mpa and contact_area_mm2 (true area) are those of the asperities;
friction_coefficient is torque over load and radius.

Several values of --speed give a Stribeck curve: "curve" has one result for each, with speed_rpm.

--pressure-law barus or roelands with --pressure-viscosity (1/GPa), and --compressibility dowson-higginson, describe the
oil under pressure. --bore ENGINE is the elastic main bearing of an engine file of the same diameter and width, loaded
onto its cap: bore_displacement_um is its largest displacement. Otherwise the bore is rigid. All these options can be
combined, with any cavitation, grooves and heat balance. In a rigid bore there may be no solution for an oil that
stiffens with pressure.

By eccentricity, in units: --eccentricity with all dimensions of the bearing, --speed and --viscosity or
--inlet-temperature-c give the same results, with load (N); x is along that load.

Cavitation: reynolds (p >= 0, Swift and Stieber), guembel (negative pressures of a full film set to 0), full
(Sommerfeld) or mass-conserving (oil is conserved at rupture and reformation; --squeeze is then an instant, in which the
fill of an opening gap does not change yet; by load, coefficients are found by finite differences).
Supply: widest-gap holds p = 0 on the line of the widest gap (an axial groove there, as in Butenschoen's and Raimondi
and Boyd's tables); it is the default for a rotating journal with --cavitation reynolds (unless --squeeze is negative:
the journal then presses on the oil there) or mass-conserving. In all other cases the default is none: the film reforms
by Reynolds' condition. --grooves two-axial has p = 0 in two grooves at +-90 deg to the load, of --groove-deg each.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's options."""
    add = parser.add_argument_group("by eccentricity").add_argument
    add("--length-ratio", type=float, metavar="B/D", help="width over diameter")
    add("--eccentricity", type=float, metavar="EPS", help="eccentricity over the clearance, from 0 to below 1")
    add("--squeeze", type=float, metavar="X", help="rate of eccentricity over omega, added to the rotation")
    add("--squeeze-only", action="store_true", default=None, help="pure squeeze: no rotation, growing eccentricity")
    add("--tilt", type=float, nargs=2, metavar=("A", "B"), help="displacement of the axis at z = +B/2 over c")
    add = parser.add_argument_group("by load").add_argument
    add("--diameter-mm", type=positive, metavar="MM")
    add("--width-mm", type=positive, metavar="MM")
    add("--clearance-um", type=positive, metavar="UM", help="radial clearance")
    add("--viscosity", type=positive, metavar="PAS", help="dynamic viscosity, Pa s")
    add("--speed", type=positive, nargs="+", metavar="RPM", help="rev/min; several give a Stribeck curve")
    add("--load", type=float, metavar="N")
    add("--moment-nm", type=float, nargs=2, metavar=("MX", "MY"), help="moment of the load about x and y")
    add("--grooves", metavar="KIND", help="two-axial: two axial grooves")
    add("--groove-deg", type=float, metavar="DEG", help="extent of each groove (default 20)")
    inlet, share = number(-60.0, 250.0, "degC"), number(0.0, 1.0, "of the friction")
    add("--inlet-temperature-c", type=inlet, metavar="T", help="heat balance instead of --viscosity")
    add("--oil-viscosity-40", type=positive, metavar="NU", help="mm^2/s at 40 degC")
    add("--oil-viscosity-100", type=positive, metavar="NU", help="mm^2/s at 100 degC")
    add("--oil-density", type=positive, metavar="RHO", help=f"kg/m^3 (default {OIL_DENSITY:g})")
    grade = add("--oil-grade", metavar="GRADE", help=f"typical oil in place of these three: {', '.join(OIL_GRADES)}")
    of_words(grade, OIL_GRADES)
    add("--heat-share", type=share, metavar="X", help="fraction of friction heat in the oil (0.8; adiabatic: 1)")
    add("--film-temperature", metavar="WAY", help="heat-balance (default) or adiabatic, with --inlet-temperature-c")
    add("--carry-over", type=number(0.0, 1.0, "of the hot oil"), metavar="X", help="of an adiabatic film (default 1)")
    add = parser.add_argument
    add = parser.add_argument_group("in units: surfaces, oil under pressure, bore").add_argument
    add("--roughness-um", type=positive, metavar="UM", help="of both surfaces together (default: smooth)")
    add("--roughness-pattern", type=positive, metavar="GAMMA", help="stretched along the motion (default 1)")
    add("--asperity-factor", type=positive, metavar="X", help="eta beta sigma (default 0.05)")
    add("--asperity-density", type=positive, metavar="ETA", help="1/mm^2, instead of --asperity-factor")
    add("--asperity-ratio", type=positive, metavar="X", help="sigma/beta (default 0.01)")
    add("--asperity-radius-um", type=positive, metavar="UM", help="beta, instead of --asperity-ratio")
    add("--contact-modulus-gpa", type=positive, metavar="E", help="of both surfaces together (default 58.6)")
    add("--hardness-mpa", type=positive, metavar="MPA", help="of the softer surface (default 300)")
    add("--boundary-friction", type=number(0.0, 1.0, "of the contact pressure"), metavar="MU", help="default 0.1")
    shear = number(0.0, 1e4, "MPa")
    add("--boundary-shear-mpa", type=shear, metavar="TAU", help="on the area that truly touches (default 0)")
    add("--pressure-law", metavar="LAW", help="none (default), barus or roelands")
    add("--pressure-viscosity", type=positive, metavar="ALPHA", help="pressure-viscosity coefficient, 1/GPa")
    add("--compressibility", metavar="LAW", help="none (default) or dowson-higginson")
    add("--bore", metavar="ENGINE", help="elastic bore of this engine's main bearing (default: rigid)")
    add = parser.add_argument
    kinds = "reynolds (default), guembel, full or mass-conserving"
    add("--cavitation", default="reynolds", metavar="KIND", help=kinds)
    add("--supply", metavar="KIND", help="widest-gap or none, see above")
    grid = "intervals around and over the width (default 96 16, mass-conserving 160 16, with --tilt 160 24; by load "
    add("--grid", type=int, nargs=2, metavar=("N_PHI", "N_Z"), help=grid + "160 16, grooved 192 16)")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Run one of the two forms; what belongs to the other is refused."""
    form = "eccentricity" if options.eccentricity is not None else "load"
    if form == "eccentricity" and options.length_ratio is None and any(_given_of(options, UNITS)):
        form = "place"
    if form == "load" and options.load is None:
        raise InputError("bearing needs --eccentricity (with --length-ratio) or --load (with the bearing's dimensions)")
    foreign = _given_of(options, FOREIGN[form])
    if foreign:
        what = "load" if form == "load" else "eccentricity"
        raise InputError(f"--{foreign[0].replace('_', '-')} does not go with --{what}; leave one out")
    needed = NEEDED[form]
    if form != "eccentricity" and _given_of(options, HEAT):
        if options.viscosity is not None:
            raise InputError("--viscosity does not go with --inlet-temperature-c, which gives it; leave one out")
        needed = tuple(name for name in needed if name != "viscosity") + HEAT[:3]
        _take_grade(options)
    missing = [f"--{name.replace('_', '-')}" for name in needed if getattr(options, name) is None]
    if missing:
        what = "load" if form == "load" else "eccentricity"
        raise InputError(f"bearing with --{what} also needs {', '.join(missing)}")
    if options.speed is not None and len(options.speed) > 1:
        return _curve(options)
    result = _given(options) if form == "eccentricity" else _loaded(options, options.speed[0])
    if not options.json:
        norm = "eccentricity" if form == "eccentricity" else "load"
        rows = [(key, _text(value), _UNITS.get((norm, key), "")) for key, value in result.items() if key not in _LONG]
        show_rows("Plain bearing", ("value", "", "unit or norm"), rows)
    return result


def _take_grade(options: argparse.Namespace) -> None:
    """Viscosities and density of an oil that is given by its grade; ``InputError`` where they are given besides."""
    if options.oil_grade is None:
        return
    one_of("--oil-grade", options.oil_grade, OIL_GRADES)
    if given := _given_of(options, HEAT[1:4]):
        raise InputError(
            f"--{given[0].replace('_', '-')} does not go with --oil-grade, which has its own; leave one of them out"
        )
    grade = GRADES[options.oil_grade]
    options.oil_viscosity_40, options.oil_viscosity_100 = grade.warm, grade.hot
    options.oil_density = grade.density * (1.0 - EXPANSION * (HOT - COOL))


def _given_of(options: argparse.Namespace, names: tuple[str, ...]) -> list[str]:
    """Those of ``names`` that the user gave."""
    return [name for name in names if getattr(options, name) is not None]


def _timed(compute: Callable[[], Any]) -> tuple[Any, float]:
    """Result, and median of the seconds of further runs: the first one may load or compile kernels."""
    result = compute()
    times: list[float] = []
    while len(times) < TIMED_RUNS and sum(times) < TIMED_SECONDS:
        start = time.perf_counter()
        compute()
        times.append(time.perf_counter() - start)
    return result, statistics.median(times)


def _given(options: argparse.Namespace) -> dict[str, Any]:
    """Results of a bearing at an eccentricity."""
    from cranktrain.film.steady.sommerfeld import prescribed_film

    film, seconds = _timed(
        lambda: prescribed_film(
            options.length_ratio,
            options.eccentricity,
            squeeze=options.squeeze or 0.0,
            squeeze_only=bool(options.squeeze_only),
            tilt=tuple(options.tilt or (0.0, 0.0)),
            cavitation=options.cavitation,
            supply=options.supply,
            grid=tuple(options.grid) if options.grid else None,
        )
    )
    return {
        "sommerfeld": film.sommerfeld,
        "attitude_deg": math.degrees(film.attitude),
        "side_flow": film.side_flow,
        "friction": film.friction,
        "p_max": film.p_max,
        "force": list(film.force),
        "moment": list(film.moment),
        "seconds": seconds,
    }


def _curve(options: argparse.Namespace) -> dict[str, Any]:
    """Results over the speed: a Stribeck curve."""
    curve = [{"speed_rpm": speed, **_loaded(options, speed)} for speed in options.speed]
    if not options.json:
        keys = [key for key in _OF_CURVE if key in curve[0]]
        rows = [tuple(f"{found[key]:.5g}" for key in keys) for found in curve]
        show_rows("Plain bearing over speed", tuple(_OF_CURVE[key] for key in keys), rows)
    return {"curve": curve}


def _loaded(options: argparse.Namespace, speed_rpm: float) -> dict[str, Any]:
    """Results of a bearing under a load, or at a place in units."""
    from cranktrain.film.steady.plain_bearing import FIELDS, Bearing

    given = {name: getattr(options, name, None) for name in FIELDS}
    given |= {"speed_rpm": speed_rpm, "viscosity_pas": options.viscosity}
    if options.bore is not None:
        from cranktrain.structure.assembly import elastic_bore

        given["bore"] = elastic_bore(load_engine(options.bore), flexible=False)
    bearing = Bearing(**{name: value for name, value in given.items() if value is not None})
    result, seconds = _timed(bearing.analysis(options.load, options.moment_nm, _option, options.eccentricity or 0.0))
    return {**result, "seconds": seconds}


def _option(field: str) -> str:
    """What the command line calls a field of a bearing."""
    return {"speed_rpm": "--speed", "viscosity_pas": "--viscosity"}.get(field, "--" + field.replace("_", "-"))


def _text(value: Any) -> str:
    """A number, vector or matrix for people."""
    if isinstance(value, list):
        return "\n".join(map(_text, value)) if isinstance(value[0], list) else "  ".join(f"{v:.5g}" for v in value)
    return f"{value:.5g}"


_LONG = ("film_angle_deg", "film_temperature_c")
"""Results that are not printed."""
_OF_CURVE = {
    "speed_rpm": "rev/min",
    "eccentricity": "eccentricity",
    "min_film_um": "least film / um",
    "friction_coefficient": "friction coefficient",
    "friction_torque": "friction torque / N m",
    "contact_load": "contact load / N",
    "load": "load / N",
}
_UNITS = {
    ("eccentricity", "sommerfeld"): "F psi²/(B D eta omega)",
    ("eccentricity", "side_flow"): "Q/(R³ psi omega)",
    ("eccentricity", "friction"): "mu_f/psi",
    ("eccentricity", "p_max"): "p psi²/(eta omega)",
    ("eccentricity", "force"): "F psi²/(B D eta omega), x along the eccentricity",
    ("eccentricity", "moment"): "M psi²/(B² D eta omega)",
    ("load", "eccentricity"): "over the clearance",
    ("load", "tilt"): "at the end, over the clearance",
    ("load", "stiffness"): "N/m, x along the load",
    ("load", "damping"): "N s/m",
    ("load", "whirl_threshold"): "omega_s sqrt(c m/W)",
    ("load", "load"): "N",
    ("load", "contact_load"): "N, part of the load",
    ("load", "contact_friction_torque"): "N m, part of friction_torque",
    ("load", "friction_coefficient"): "torque over load and radius",
    ("load", "flow"): "m³/s",
    ("load", "friction_torque"): "N m",
    ("load", "p_max"): "Pa",
    ("load", "viscosity"): "Pa s",
    ("load", "heat"): "W",
}
