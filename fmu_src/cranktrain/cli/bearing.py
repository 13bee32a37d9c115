"""The verb ``bearing``: one plain bearing, by its eccentricity (dimensionless) or by its load (in units)."""

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

from cranktrain.cli.console import show_rows
from cranktrain.cli.functions import verb_alone
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.engine.file import load_engine
from cranktrain.engine.oil_grades import COOL, EXPANSION, GRADES, HOT
from cranktrain.engine.quantities import OIL_GRADES
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import POSITIVE, Option, Question, several

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
    "diameter_mm", "width_mm", "clearance_um", "viscosity", "speed", "load_n", "moment_nm", "grooves", "groove_deg",
    *HEAT, *SURFACES, "pressure_law", "pressure_viscosity", "compressibility", "bore",
)  # fmt: skip
UNITS = (*LOADED[:5], *HEAT)
NEEDED = {"eccentricity": ("length_ratio",), "load": LOADED[:5], "place": LOADED[:5]}
FOREIGN = {"eccentricity": LOADED, "load": GIVEN, "place": ("load_n", "moment_nm", "grooves", "groove_deg", *GIVEN[2:])}
OIL_DENSITY = 860.0
Above = Annotated[float, POSITIVE]
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

By load: --diameter-mm, --width-mm, --clearance-um (radial), --viscosity (Pa s), --speed (rev/min), --load-n; x along
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


@dataclass(frozen=True, kw_only=True)
class ByEccentricity(Question):
    """Options of a bearing with given eccentricity, without units."""

    heading = "by eccentricity"
    length_ratio: Annotated[float | None, Option("B/D", "width over diameter")] = None
    eccentricity: Annotated[float | None, Option("EPS", "eccentricity over the clearance, from 0 to below 1")] = None
    squeeze: Annotated[float | None, Option("X", "rate of eccentricity over omega, added to the rotation")] = None
    squeeze_only: Annotated[bool | None, Option(help="pure squeeze: no rotation, growing eccentricity")] = None
    tilt: Annotated[
        Sequence[float] | None, Option(("A", "B"), "displacement of the axis at z = +B/2 over c", count=2)
    ] = None


@dataclass(frozen=True, kw_only=True)
class ByLoad(Question):
    """Options of a bearing with given load, in units."""

    heading = "by load"
    diameter_mm: Annotated[Above | None, Option("MM")] = None
    width_mm: Annotated[Above | None, Option("MM")] = None
    clearance_um: Annotated[Above | None, Option("UM", "radial clearance")] = None
    viscosity: Annotated[Above | None, Option("PAS", "dynamic viscosity, Pa s")] = None
    speed: Annotated[Above | Sequence[Above] | None, Option("RPM", "rev/min; several give a Stribeck curve")] = None
    load_n: Annotated[float | None, Option("N", "load, N", was="--load")] = None
    moment_nm: Annotated[Sequence[float] | None, Option(("MX", "MY"), "moment of the load about x and y", count=2)] = (
        None
    )
    grooves: Annotated[str | None, Option("KIND", "two-axial: two axial grooves")] = None
    groove_deg: Annotated[float | None, Option("DEG", "extent of each groove (default 20)")] = None
    inlet_temperature_c: Annotated[
        float | None, between(-60.0, 250.0, "degC"), Option("T", "heat balance instead of --viscosity")
    ] = None
    oil_viscosity_40: Annotated[Above | None, Option("NU", "mm^2/s at 40 degC")] = None
    oil_viscosity_100: Annotated[Above | None, Option("NU", "mm^2/s at 100 degC")] = None
    oil_density: Annotated[Above | None, Option("RHO", f"kg/m^3 (default {OIL_DENSITY:g})")] = None
    oil_grade: Annotated[
        str | None, Option("GRADE", f"typical oil in place of these three: {', '.join(OIL_GRADES)}", words=OIL_GRADES)
    ] = None
    heat_share: Annotated[
        float | None,
        between(0.0, 1.0, "of the friction"),
        Option("X", "fraction of friction heat in the oil (0.8; adiabatic: 1)"),
    ] = None
    film_temperature: Annotated[
        str | None, Option("WAY", "heat-balance (default) or adiabatic, with --inlet-temperature-c")
    ] = None
    carry_over: Annotated[
        float | None, between(0.0, 1.0, "of the hot oil"), Option("X", "of an adiabatic film (default 1)")
    ] = None


@dataclass(frozen=True, kw_only=True)
class InUnits(Question):
    """Options for surfaces, oil under pressure and bore of a bearing in units."""

    heading = "in units: surfaces, oil under pressure, bore"
    roughness_um: Annotated[Above | None, Option("UM", "of both surfaces together (default: smooth)")] = None
    roughness_pattern: Annotated[Above | None, Option("GAMMA", "stretched along the motion (default 1)")] = None
    asperity_factor: Annotated[Above | None, Option("X", "eta beta sigma (default 0.05)")] = None
    asperity_density: Annotated[Above | None, Option("ETA", "1/mm^2, instead of --asperity-factor")] = None
    asperity_ratio: Annotated[Above | None, Option("X", "sigma/beta (default 0.01)")] = None
    asperity_radius_um: Annotated[Above | None, Option("UM", "beta, instead of --asperity-ratio")] = None
    contact_modulus_gpa: Annotated[Above | None, Option("E", "of both surfaces together (default 58.6)")] = None
    hardness_mpa: Annotated[Above | None, Option("MPA", "of the softer surface (default 300)")] = None
    boundary_friction: Annotated[
        float | None, between(0.0, 1.0, "of the contact pressure"), Option("MU", "default 0.1")
    ] = None
    boundary_shear_mpa: Annotated[
        float | None, between(0.0, 1e4, "MPa"), Option("TAU", "on the area that truly touches (default 0)")
    ] = None
    pressure_law: Annotated[str | None, Option("LAW", "none (default), barus or roelands")] = None
    pressure_viscosity: Annotated[Above | None, Option("ALPHA", "pressure-viscosity coefficient, 1/GPa")] = None
    compressibility: Annotated[str | None, Option("LAW", "none (default) or dowson-higginson")] = None
    bore: Annotated[
        words.File | None, Option("ENGINE", "elastic bore of this engine's main bearing (default: rigid)")
    ] = None


@dataclass(frozen=True, kw_only=True)
class PlainBearing(ByEccentricity, ByLoad, InUnits):
    """Question of :func:`bearing`."""

    heading = ""
    cavitation: Annotated[str, Option("KIND", "reynolds (default), guembel, full or mass-conserving")] = "reynolds"
    supply: Annotated[str | None, Option("KIND", "widest-gap or none, see above")] = None
    grid: Annotated[
        Sequence[int] | None,
        Option(
            ("N_PHI", "N_Z"),
            "intervals around and over the width (default 96 16, mass-conserving 160 16, with --tilt 160 24; by "
            "load 160 16, grooved 192 16)",
            count=2,
        ),
    ] = None


@verb_alone(PlainBearing, DESCRIPTION)
def bearing(ask: PlainBearing) -> VerbResult:
    """Solve a bearing given by eccentricity or by load; options of the other form are refused."""
    form = "eccentricity" if ask.eccentricity is not None else "load"
    if form == "eccentricity" and ask.length_ratio is None and any(_given_of(ask, UNITS)):
        form = "place"
    if form == "load" and ask.load_n is None:
        raise InputError(
            "bearing needs --eccentricity (with --length-ratio) or --load-n (with the bearing's dimensions)"
        )
    what = "load-n" if form == "load" else "eccentricity"
    if foreign := _given_of(ask, FOREIGN[form]):
        raise InputError(f"--{foreign[0].replace('_', '-')} does not go with --{what}; leave one out")
    needed = NEEDED[form]
    if form != "eccentricity" and (heat := _given_of(ask, HEAT)):
        if ask.viscosity is not None:
            named = heat[0].replace("_", "-")
            raise InputError(
                f"--viscosity does not go with --{named}, with which the inlet temperature gives it; leave one out"
            )
        needed = tuple(name for name in needed if name != "viscosity") + HEAT[:3]
        ask = _with_grade(ask)
    missing = [f"--{name.replace('_', '-')}" for name in needed if getattr(ask, name) is None]
    if missing:
        raise InputError(f"bearing with --{what} also needs {', '.join(missing)}")
    speeds = several(ask.speed)
    if len(speeds) > 1:
        return VerbResult.of(
            {"curve": [{"speed_rpm": speed, **_loaded(ask, speed)} for speed in speeds]}, "bearing plain"
        )
    norm = "eccentricity" if form == "eccentricity" else "load"
    return VerbResult.of(_given(ask) if form == "eccentricity" else _loaded(ask, speeds[0]), "bearing plain", norm=norm)


def show(found: VerbResult) -> None:
    """Print a bearing's values with their units or norms, or a Stribeck curve."""
    if "curve" in found:
        keys = [key for key in _OF_CURVE if key in found["curve"][0]]
        rows = [tuple(f"{one[key]:.5g}" for key in keys) for one in found["curve"]]
        show_rows("Plain bearing over speed", tuple(_OF_CURVE[key] for key in keys), rows)
        return
    norm = found.beside["norm"]
    values = [(key, _text(value), _UNITS.get((norm, key), "")) for key, value in found.items() if key not in _LONG]
    show_rows("Plain bearing", ("value", "", "unit or norm"), values)


def _with_grade(ask: PlainBearing) -> PlainBearing:
    """Request with viscosities and density of the oil grade; ``InputError`` if they are given in addition."""
    if ask.oil_grade is None:
        return ask
    if given := _given_of(ask, HEAT[1:4]):
        raise InputError(
            f"--{given[0].replace('_', '-')} does not go with --oil-grade, which has its own; leave one of them out"
        )
    grade = GRADES[ask.oil_grade]
    density = grade.density * (1.0 - EXPANSION * (HOT - COOL))
    return replace(ask, oil_viscosity_40=grade.warm, oil_viscosity_100=grade.hot, oil_density=density)


def _given_of(ask: PlainBearing, names: tuple[str, ...]) -> list[str]:
    """Options among ``names`` that the user gave."""
    return [name for name in names if getattr(ask, name) is not None]


def _timed(compute: Callable[[], Any]) -> tuple[Any, float]:
    """Result, and median time (s) of further calls; the first one may load or compile kernels."""
    result = compute()
    times: list[float] = []
    while len(times) < TIMED_RUNS and sum(times) < TIMED_SECONDS:
        start = time.perf_counter()
        compute()
        times.append(time.perf_counter() - start)
    return result, statistics.median(times)


def _given(ask: PlainBearing) -> dict[str, Any]:
    """Results of a bearing at an eccentricity."""
    from cranktrain.film.steady.sommerfeld import prescribed_film

    film, seconds = _timed(
        lambda: prescribed_film(
            ask.length_ratio or 0.0,
            ask.eccentricity or 0.0,
            squeeze=ask.squeeze or 0.0,
            squeeze_only=bool(ask.squeeze_only),
            tilt=(ask.tilt[0], ask.tilt[1]) if ask.tilt else (0.0, 0.0),
            cavitation=ask.cavitation,
            supply=ask.supply,
            grid=(ask.grid[0], ask.grid[1]) if ask.grid else None,
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


def _loaded(ask: PlainBearing, speed_rpm: float) -> dict[str, Any]:
    """Results of a bearing under a load, or with the journal at a given position, in units."""
    from cranktrain.film.steady.plain_bearing import FIELDS, Bearing

    given = {name: getattr(ask, name, None) for name in FIELDS}
    given |= {"speed_rpm": speed_rpm, "viscosity_pas": ask.viscosity}
    if ask.bore is not None:
        from cranktrain.structure.assembly import elastic_bore

        given["bore"] = elastic_bore(load_engine(ask.bore), flexible=False)
    moment = None if ask.moment_nm is None else (ask.moment_nm[0], ask.moment_nm[1])
    bearing = Bearing(**{name: value for name, value in given.items() if value is not None})
    result, seconds = _timed(bearing.analysis(ask.load_n, moment, _option, ask.eccentricity or 0.0))
    return {**result, "seconds": seconds}


def _option(field: str) -> str:
    """Option of the command line for a field of a bearing."""
    return {"speed_rpm": "--speed", "viscosity_pas": "--viscosity"}.get(field, "--" + field.replace("_", "-"))


def _text(value: Any) -> str:
    """Text of a number, vector or matrix."""
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
