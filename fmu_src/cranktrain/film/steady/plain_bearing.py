"""Plain bearing in steady rotation, under a load or at a given position, in engineering units.

Films between smooth rigid surfaces with constant oil properties and without oil conservation are solved by
:mod:`cranktrain.film.steady.bearing`. All other films, and all films at a given journal position, are solved by
:mod:`cranktrain.film.steady.mixed_bearing`, which combines all effects.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from cranktrain.core.errors import InputError, nearest, within
from cranktrain.core.units import RPM
from cranktrain.engine.lubricant import pressure_constants
from cranktrain.engine.parts import Oil
from cranktrain.film.elastic.bore_compliance import BoreCompliance
from cranktrain.film.steady.adiabatic_bearing import adiabatic_bearing
from cranktrain.film.steady.bearing import Journal, SteadyBearing, SteadyState, bearing_grid
from cranktrain.film.steady.conserving_bearing import DEFAULT_GRID
from cranktrain.film.steady.mixed_bearing import MixedBearing, Surroundings
from cranktrain.film.steady.sommerfeld import CAVITATION
from cranktrain.film.steady.surfaces import Surfaces
from cranktrain.film.steady.warm_bearing import warm_bearing

ZERO_CELSIUS = 273.15
HEAT_CAPACITY = 2000.0
"""Default heat capacity of the oil, J/(kg K)."""
HEAT_SHARES = {"heat-balance": 0.8, "adiabatic": 1.0}
"""Models of the film temperature, with the default fraction of friction that heats the oil."""
CONSERVING = "mass-conserving"
ELASTIC_GRID = (96, 12)
FILM_STEP = 5.0
"""Angular spacing of film temperatures in a result, degrees."""
COMPRESSIBILITIES = ("none", "dowson-higginson")
_BOUNDS = {
    "diameter_mm": (0.1, 1e4, "mm"),
    "width_mm": (0.1, 1e4, "mm"),
    "clearance_um": (1e-3, 1e5, "um; it is the radial clearance"),
    "speed_rpm": (1e-3, 1e6, "rev/min"),
    "viscosity_mpas": (1e-4, 1e7, "mPa s"),
    "viscosity_pas": (1e-7, 1e4, "Pa s"),
    "inlet_temperature_c": (-60.0, 250.0, "degC"),
    "oil_viscosity_40": (0.5, 1e6, "mm^2/s"),
    "oil_viscosity_100": (0.5, 1e6, "mm^2/s"),
    "oil_density": (300.0, 3000.0, "kg/m^3"),
    "heat_share": (0.0, 1.0, "of the friction"),
    "carry_over": (0.0, 1.0, "of the hot oil"),
    "pressure_viscosity": (1e-3, 1e3, "1/GPa"),
}

Moment = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Bearing(Surfaces):
    """Plain bearing whose oil is given by viscosity, or by inlet temperature and Walther's law (ASTM D341).

    Attributes
    ----------
    diameter_mm, width_mm : diameter and width of the bore
    clearance_um : radial clearance
    speed_rpm : speed of the journal in a bore at rest, rev/min
    viscosity_mpas, viscosity_pas : dynamic viscosity, mPa s or Pa s
    inlet_temperature_c : inlet temperature, instead of the viscosity; the film temperature follows from heat balance
    oil_viscosity_40, oil_viscosity_100 : kinematic viscosities at 40 and 100 °C, mm²/s
    oil_density : kg/m³
    heat_share : fraction of the friction power that heats the oil; None: 0.8 in a heat balance, 1 in an adiabatic film
    film_temperature : heat-balance (one temperature for the film) or adiabatic (warming along the circumference)
    carry_over : fraction of the hot oil that an adiabatic film carries past its supply; None for all
    cavitation : reynolds, guembel, full or mass-conserving
    supply : widest-gap or none; None for the default of the cavitation model
    grooves : two-axial, at ±90° to the load, each of ``groove_deg``
    grid : grid intervals around and over the width
    roughness_um and other values of the surfaces : see :class:`cranktrain.film.steady.surfaces.Surfaces`
    pressure_law : none, barus or roelands, with ``pressure_viscosity``, 1/GPa
    compressibility : none or dowson-higginson
    bore : elastic bore, see :func:`cranktrain.structure.block.saddle.bore_compliance`; rigid by default
    """

    diameter_mm: float
    width_mm: float
    clearance_um: float
    speed_rpm: float
    viscosity_mpas: float | None = None
    viscosity_pas: float | None = None
    inlet_temperature_c: float | None = None
    oil_viscosity_40: float | None = None
    oil_viscosity_100: float | None = None
    oil_density: float = 860.0
    heat_share: float | None = None
    film_temperature: str = "heat-balance"
    carry_over: float | None = None
    cavitation: str = "reynolds"
    supply: str | None = None
    grooves: str | None = None
    groove_deg: float | None = None
    grid: tuple[int, int] | None = None
    pressure_law: str = "none"
    pressure_viscosity: float | None = None
    compressibility: str = "none"
    bore: BoreCompliance | None = None

    def equilibrium(self, load_n: float, moment_nm: Moment | None = None) -> dict[str, Any]:
        """Compute the equilibrium: eccentricity, attitude, least film, stiffness, damping, flow, friction, pressure.

        Parameters
        ----------
        load_n : load along x, N; y is at 90° in the sense of rotation
        moment_nm : moments of the load about x and y, N m; adds ``tilt`` and gives matrices of four motions

        Returns
        -------
        ``eccentricity``, ``attitude_deg``, ``min_film_um``, ``stiffness`` (N/m) and ``damping`` (N s/m) as rows of
        −∂F/∂x and −∂F/∂x', ``whirl_threshold`` ω_s √(c m/W), ``flow`` (m³/s), ``friction_torque`` (N m), ``p_max``
        (Pa); with a heat balance ``effective_temperature_c``, ``outlet_temperature_c`` and ``viscosity`` (Pa s);
        of an adiabatic film also ``largest_temperature_c`` at ``largest_temperature_deg`` from the load,
        ``supply_mixture_temperature_c`` after the supply, ``heat`` (W) and film temperatures over the angle; for rough
        surfaces ``contact_load`` (N) and ``contact_friction_torque`` (N m), the parts of the asperities,
        ``friction_coefficient`` (torque over load and radius), ``contact_pressure_max_mpa`` and ``contact_area_mm2``
        (real contact area); for an elastic bore ``bore_displacement_um``, the largest displacement

        Raises
        ------
        InputError
            if values are invalid
        """
        return self.analysis(load_n, moment_nm)()

    def at_eccentricity(self, eccentricity: float) -> dict[str, Any]:
        """Compute the results of :meth:`equilibrium` and the ``load`` (N, along x) of a journal at ``eccentricity``."""
        return self.analysis(None, None, eccentricity=eccentricity)()

    def analysis(
        self,
        load_n: float | None,
        moment_nm: Moment | None = None,
        label: Callable[[str], str] = str,
        eccentricity: float = 0.0,
    ) -> Callable[[], dict[str, Any]]:
        """Return the analysis of :meth:`equilibrium` as a function; ``label`` gives a field's name in errors.

        If ``load_n`` is None, the journal is at ``eccentricity``.
        """
        supply = self._checked(moment_nm, label)
        # Users give moments about x and y; the film uses ∫z dF = (M_y, −M_x).
        moment = None if moment_nm is None else (moment_nm[1], -moment_nm[0])
        run = self._states(load_n, eccentricity, supply, moment)
        if load_n is None and not (math.isfinite(eccentricity) and eccentricity > 0.0):
            raise InputError(f"eccentricity {eccentricity:g} must be above zero; without it there is no load")
        if load_n is None and self.bore is None and eccentricity >= 1.0:
            raise InputError(f"eccentricity {eccentricity:g}: at 1 a journal touches its rigid bore; give less than 1")
        if self.inlet_temperature_c is None:
            viscosity = 1e-3 * self.viscosity_mpas if self.viscosity_pas is None else self.viscosity_pas  # type: ignore[operator]
            return lambda: self._values(run(viscosity), moment, load_n is None)
        oil = self._oil()
        if self.film_temperature == "adiabatic":
            return self._adiabatic(oil, load_n, eccentricity, supply)

        def warm() -> dict[str, Any]:
            found = warm_bearing(oil, oil.temperatures[0], self.speed_rpm * RPM, run)
            return self._values(found.state, moment, load_n is None) | {
                "effective_temperature_c": found.effective - ZERO_CELSIUS,
                "outlet_temperature_c": found.outlet - ZERO_CELSIUS,
                "viscosity": found.viscosity,
            }

        return warm

    def _checked(self, moment: Moment | None, label: Callable[[str], str]) -> str:
        """Return the oil supply; ``InputError`` for an invalid combination of values."""
        for name, (low, high, what) in _BOUNDS.items():
            value = getattr(self, name)
            if value is not None:
                within(label(name), value, low, high, what)
        if sum(one is not None for one in (self.viscosity_mpas, self.viscosity_pas, self.inlet_temperature_c)) != 1:
            raise InputError(
                f"a bearing's oil is given by one of {label('viscosity_mpas')}, {label('viscosity_pas')} and "
                f"{label('inlet_temperature_c')}"
            )
        if self.inlet_temperature_c is not None and None in (self.oil_viscosity_40, self.oil_viscosity_100):
            raise InputError(
                f"{label('inlet_temperature_c')} needs {label('oil_viscosity_40')} and {label('oil_viscosity_100')}"
            )
        self._check_heat(moment, label)
        if self.grooves is not None and self.grooves != "two-axial":
            raise InputError(f"{label('grooves')} '{self.grooves}' does not exist; valid: two-axial")
        if self.groove_deg is not None and self.grooves is None:
            raise InputError(f"{label('groove_deg')} needs {label('grooves')} two-axial")
        if self.grooves is not None and self.supply is not None:
            raise InputError(f"{label('supply')} does not go with {label('grooves')}: the grooves are the supply")
        if self.cavitation not in CAVITATION:
            raise InputError(f"cavitation '{self.cavitation}' does not exist; {nearest(self.cavitation, CAVITATION)}")
        conserving = self.cavitation == CONSERVING
        fed = self.cavitation == "reynolds" or conserving
        supply = self.grooves or self.supply or ("widest-gap" if fed else "none")
        if supply == "widest-gap" and not fed:
            raise InputError(
                f"{label('supply')} widest-gap goes with {label('cavitation')} reynolds or {CONSERVING}; use none"
            )
        if conserving and supply == "none":
            raise InputError(
                f"a film that conserves oil runs dry with {label('supply')} none; leave it out, or use reynolds"
            )
        self._check_surroundings(label)
        return supply

    def _check_heat(self, moment: Moment | None, label: Callable[[str], str]) -> None:
        """Raise ``InputError`` for a model of film temperature that does not fit the other values."""
        if self.film_temperature not in HEAT_SHARES:
            near = nearest(self.film_temperature, HEAT_SHARES)
            raise InputError(f"{label('film_temperature')} '{self.film_temperature}' does not exist; {near}")
        adiabatic = self.film_temperature == "adiabatic"
        if self.carry_over is not None and not adiabatic:
            raise InputError(f"{label('carry_over')} needs {label('film_temperature')} adiabatic")
        if not adiabatic:
            return
        if self.inlet_temperature_c is None:
            raise InputError(f"{label('film_temperature')} adiabatic needs {label('inlet_temperature_c')}")
        if self.cavitation != CONSERVING:
            raise InputError(
                f"{label('film_temperature')} adiabatic: heat travels with the oil, so oil must be conserved; give "
                f"{label('cavitation')} {CONSERVING}"
            )
        if moment is not None:
            raise InputError(f"{label('film_temperature')} adiabatic is a mean over the width; leave the moment out")

    def _adiabatic(
        self, oil: Oil, load: float | None, eccentricity: float, supply: str
    ) -> Callable[[], dict[str, Any]]:
        """Return the analysis of a bearing whose film warms along the circumference, as a function."""
        grid = self.grid or (ELASTIC_GRID if self.bore is not None else DEFAULT_GRID)
        groove = math.radians(20.0 if self.groove_deg is None else self.groove_deg)
        bearing = MixedBearing(self._surroundings(), supply, (grid[0], grid[1]), groove)
        journal, carried = self._journal(1.0), 1.0 if self.carry_over is None else self.carry_over

        def run() -> dict[str, Any]:
            found = adiabatic_bearing(oil, oil.temperatures[0], bearing, journal, load, (eccentricity, 0.0), carried)
            even = np.radians(np.arange(0.0, 360.0, FILM_STEP))
            film = np.interp(even, found.angle, found.temperature, period=2.0 * math.pi)
            return self._values(found.state, None, load is None) | {
                "supply_mixture_temperature_c": found.mixed - ZERO_CELSIUS,
                "largest_temperature_c": float(found.temperature.max()) - ZERO_CELSIUS,
                "largest_temperature_deg": math.degrees(found.angle[found.temperature.argmax()]),
                "outlet_temperature_c": found.outlet - ZERO_CELSIUS,
                "heat": found.heat,
                "film_angle_deg": np.degrees(even).tolist(),
                "film_temperature_c": (film - ZERO_CELSIUS).tolist(),
            }

        return run

    def _journal(self, viscosity: float) -> Journal:
        """Return the journal at a viscosity, Pa s."""
        diameter, width = 1e-3 * self.diameter_mm, 1e-3 * self.width_mm
        return Journal(diameter, width, 1e-6 * self.clearance_um, viscosity, self.speed_rpm * RPM)

    def _check_surroundings(self, label: Callable[[str], str]) -> None:
        """Raise ``InputError`` for surfaces, oil laws or a bore that do not fit together."""
        self.check_surfaces(label)
        if (self.pressure_law != "none") != (self.pressure_viscosity is not None):
            raise InputError(
                f"{label('pressure_law')} and {label('pressure_viscosity')} go together; oils have 15 to 25 1/GPa"
            )
        if self.compressibility not in COMPRESSIBILITIES:
            near = nearest(self.compressibility, COMPRESSIBILITIES)
            raise InputError(f"{label('compressibility')} '{self.compressibility}' does not exist; {near}")
        area = 1e-6 * math.pi * self.diameter_mm * self.width_mm
        if self.bore is not None and not math.isclose(self.bore.area, area, rel_tol=1e-3):
            raise InputError(
                f"the elastic bore is of {1e6 * self.bore.area:.5g} mm^2, this bearing of {1e6 * area:.5g} mm^2; "
                f"give {label('diameter_mm')} and {label('width_mm')} of the bearing that the bore belongs to"
            )

    def _surroundings(self) -> Surroundings:
        """Return the models of cavitation, oil, surfaces and bore."""
        roughness, contact = self.rough()
        oil = None
        if self.pressure_law != "none" or self.compressibility != "none":
            slope = 1e-9 * (self.pressure_viscosity or 0.0)
            # Only the dependence of this oil on pressure is used.
            oil = Oil(
                density=self.oil_density, temperature_speeds=(0.0,), temperatures=(ZERO_CELSIUS,), supply_pressure=0.0,
                pressure_law=self.pressure_law, pressure_viscosity=slope, compressibility=self.compressibility,
            )  # fmt: skip
            pressure_constants(oil, 1.0)
        return Surroundings(self.cavitation, oil, roughness, contact, self.bore)

    def _states(
        self, load: float | None, eccentricity: float, supply: str, moment: Moment | None
    ) -> Callable[[float], SteadyState]:
        """Return the steady state as a function of viscosity, Pa s."""
        groove = math.radians(20.0 if self.groove_deg is None else self.groove_deg)

        around = self._surroundings()
        if load is None or around != Surroundings(self.cavitation) or self.cavitation == CONSERVING:
            grid = self.grid or (ELASTIC_GRID if self.bore is not None else DEFAULT_GRID)
            mixed = MixedBearing(around, supply, (grid[0], grid[1]), groove)
            return lambda eta: mixed.state(self._journal(eta), load, moment, (eccentricity, 0.0))
        n_phi, n_z = self.grid or (0, 16)
        steady = SteadyBearing(
            bearing_grid(
                supply, n_phi=n_phi, n_z=n_z, tilted=moment is not None, rupture=self.cavitation, groove=groove,
                ratio=self.width_mm / self.diameter_mm,
            )
        )  # fmt: skip
        return lambda eta: steady.state(self._journal(eta), load, moment)

    def _values(self, state: SteadyState, moment: Moment | None, placed: bool) -> dict[str, Any]:
        """Return the results in the units of users."""
        found = _values(state, moment)
        if placed:
            found["load"] = state.load
        if self.roughness_um is not None:
            found |= {
                "contact_load": state.contact_load,
                "contact_friction_torque": state.contact_torque,
                "friction_coefficient": state.friction_torque / (state.load * 0.5e-3 * self.diameter_mm),
                "contact_pressure_max_mpa": 1e-6 * state.contact_pressure,
                "contact_area_mm2": 1e6 * state.contact_area,
            }
        if self.bore is not None:
            found["bore_displacement_um"] = 1e6 * state.bore_opening
        return found

    def _oil(self) -> Oil:
        """Return the oil by Walther's law."""
        inlet, thin, thick = self.inlet_temperature_c, self.oil_viscosity_40, self.oil_viscosity_100
        assert inlet is not None and thin is not None and thick is not None  # checked before
        return Oil(
            density=self.oil_density,
            temperature_speeds=(0.0,),
            temperatures=(inlet + ZERO_CELSIUS,),
            supply_pressure=0.0,
            law="walther",
            walther_temperatures=(40.0 + ZERO_CELSIUS, 100.0 + ZERO_CELSIUS),
            walther_viscosities=(1e-6 * thin, 1e-6 * thick),
            heat_capacity=HEAT_CAPACITY,
            heat_share=HEAT_SHARES[self.film_temperature] if self.heat_share is None else self.heat_share,
        )


FIELDS = tuple(field.name for field in fields(Bearing))


def _values(state: SteadyState, moment: Moment | None) -> dict[str, Any]:
    result: dict[str, Any] = {
        "eccentricity": math.hypot(*state.eccentricity),
        "attitude_deg": math.degrees(state.attitude),
        "min_film_um": 1e6 * state.least_film,
        "stiffness": state.stiffness.tolist(),
        "damping": state.damping.tolist(),
        "whirl_threshold": state.whirl_threshold,
        "flow": state.flow,
        "friction_torque": state.friction_torque,
        "p_max": state.largest_pressure,
    }
    if moment is not None:
        result["tilt"] = state.tilt.tolist()
    return result
