"""One plain bearing with a rigid bore under a steady load, in engineering units."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

from cranktrain.core.errors import InputError, nearest
from cranktrain.engine.parts import Oil
from cranktrain.film.steady.bearing import Journal, SteadyBearing, SteadyState, bearing_grid
from cranktrain.film.steady.conserving_bearing import DEFAULT_GRID, conserving_state
from cranktrain.film.steady.sommerfeld import CAVITATION
from cranktrain.film.steady.warm_bearing import warm_bearing

RPM = math.pi / 30.0
ZERO_CELSIUS = 273.15
HEAT_CAPACITY = 2000.0
"""Of the oil, J/(kg K)."""
CONSERVING = "mass-conserving"
_POSITIVE = ("diameter_mm", "width_mm", "clearance_um", "speed_rpm", "viscosity_mpas", "viscosity_pas", "oil_density")

Moment = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Bearing:
    """A plain bearing whose oil is given by its viscosity, or by its inlet temperature and Walther's law (ASTM D341).

    Attributes
    ----------
    diameter_mm, width_mm : of the bore
    clearance_um : radial
    speed_rpm : of the journal in a bore at rest, rev/min
    viscosity_mpas, viscosity_pas : dynamic, mPa s or Pa s
    inlet_temperature_c : instead of the viscosity: the film is as warm as its heat balance makes it
    oil_viscosity_40, oil_viscosity_100 : kinematic viscosities at 40 and 100 °C, mm²/s
    oil_density : kg/m³
    heat_share : share of the friction power that warms the oil
    cavitation : reynolds, guembel, full or mass-conserving
    supply : widest-gap or none; None as the cavitation suggests
    grooves : two-axial, at ±90° to the load, each of ``groove_deg``
    grid : intervals around and over the width
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
    heat_share: float = 0.8
    cavitation: str = "reynolds"
    supply: str | None = None
    grooves: str | None = None
    groove_deg: float | None = None
    grid: tuple[int, int] | None = None

    def equilibrium(self, load_n: float, moment_nm: Moment | None = None) -> dict[str, Any]:
        """Eccentricity over c, attitude, least film, stiffness and damping, flow, friction, largest pressure.

        Parameters
        ----------
        load_n : N, along x; y 90° on in the sense of rotation
        moment_nm : of the load about x and y, N m; the result then has ``tilt`` and matrices of four motions

        Returns
        -------
        ``eccentricity``, ``attitude_deg``, ``min_film_um``, ``stiffness`` (N/m) and ``damping`` (N s/m) as rows of
        −∂F/∂x and −∂F/∂x', ``whirl_threshold`` ω_s √(c m/W), ``flow`` (m³/s), ``friction_torque`` (N m), ``p_max``
        (Pa); with a heat balance ``effective_temperature_c``, ``outlet_temperature_c`` and ``viscosity`` (Pa s)

        Raises
        ------
        InputError
            values that cannot be used
        """
        return self.analysis(load_n, moment_nm)()

    def analysis(
        self, load_n: float, moment_nm: Moment | None = None, label: Callable[[str], str] = str
    ) -> Callable[[], dict[str, Any]]:
        """What :meth:`equilibrium` computes, ready to run; ``label`` says what a user calls a field in an error."""
        supply = self._checked(moment_nm, label)
        # About x and y; the film's own pair is ∫z dF = (M_y, −M_x).
        moment = None if moment_nm is None else (moment_nm[1], -moment_nm[0])
        run = self._states(load_n, supply, moment)
        if self.inlet_temperature_c is None:
            viscosity = 1e-3 * self.viscosity_mpas if self.viscosity_pas is None else self.viscosity_pas  # type: ignore[operator]
            return lambda: _values(run(viscosity), moment)
        oil = self._oil()

        def warm() -> dict[str, Any]:
            found = warm_bearing(oil, oil.temperatures[0], self.speed_rpm * RPM, run)
            return _values(found.state, moment) | {
                "effective_temperature_c": found.effective - ZERO_CELSIUS,
                "outlet_temperature_c": found.outlet - ZERO_CELSIUS,
                "viscosity": found.viscosity,
            }

        return warm

    def _checked(self, moment: Moment | None, label: Callable[[str], str]) -> str:
        """Where the oil comes from; refuses what does not go together with ``InputError``."""
        for name in _POSITIVE:
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise InputError(f"{label(name)} {value:g} must be a positive number")
        if sum(one is not None for one in (self.viscosity_mpas, self.viscosity_pas, self.inlet_temperature_c)) != 1:
            raise InputError(
                f"a bearing's oil is given by one of {label('viscosity_mpas')}, {label('viscosity_pas')} and "
                f"{label('inlet_temperature_c')}"
            )
        if self.inlet_temperature_c is not None and None in (self.oil_viscosity_40, self.oil_viscosity_100):
            raise InputError(
                f"{label('inlet_temperature_c')} needs {label('oil_viscosity_40')} and {label('oil_viscosity_100')}"
            )
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
        if conserving and moment is not None:
            raise InputError(
                f"{label('moment_nm')} needs {label('cavitation')} reynolds, guembel or full; {CONSERVING} has no tilt"
            )
        return supply

    def _states(self, load: float, supply: str, moment: Moment | None) -> Callable[[float], SteadyState]:
        """The bearing as a function of its viscosity, Pa s."""
        groove = math.radians(20.0 if self.groove_deg is None else self.groove_deg)

        def journal(viscosity: float) -> Journal:
            return Journal(
                1e-3 * self.diameter_mm, 1e-3 * self.width_mm, 1e-6 * self.clearance_um, viscosity,
                self.speed_rpm * RPM,
            )  # fmt: skip

        if self.cavitation == CONSERVING:
            grid = self.grid or DEFAULT_GRID
            return lambda eta: conserving_state(journal(eta), load, supply, (grid[0], grid[1]), groove)
        n_phi, n_z = self.grid or (0, 16)
        steady = SteadyBearing(
            bearing_grid(
                supply, n_phi=n_phi, n_z=n_z, tilted=moment is not None, rupture=self.cavitation, groove=groove,
                ratio=self.width_mm / self.diameter_mm,
            )
        )  # fmt: skip
        return lambda eta: steady.state(journal(eta), load, moment)

    def _oil(self) -> Oil:
        """Walther's oil."""
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
            heat_share=self.heat_share,
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
