"""One run at constant speed, requested by names and in engineering units.

A :class:`Request` is checked completely before the crankshaft is made, which may take a minute.
"""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cranktrain.core.errors import InputError
from cranktrain.core.units import RPM
from cranktrain.dynamics import simulation
from cranktrain.dynamics.load_torque import LoadTorque
from cranktrain.dynamics.model.settings import Settings, axial_force
from cranktrain.dynamics.settled.judging import TOLERANCE
from cranktrain.dynamics.settled.samples import Sink
from cranktrain.dynamics.warm_films import check_level
from cranktrain.engine.model import Engine
from cranktrain.film.laws.register import bearing_law
from cranktrain.loads.gas_pressure import Gas, GasTrace
from cranktrain.loads.run_doubts import run_doubts
from cranktrain.loads.torsional_line import torsional_line
from cranktrain.results.run import Run
from cranktrain.structure.assembly import Assembly, checked
from cranktrain.structure.fem.own_mesh import MeshFile
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import fields_of

SETTLED_IN_SINGLES = 1.0e-5
"""Settling error below which elastic films are solved in double precision, because rounding prevents repetition."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """Request for a run at constant speed.

    Attributes
    ----------
    speed_rpm : rev/min; with ``load_torque_nm`` the initial speed
    cycles : of 720 degrees; the last one is evaluated. None: until the outputs repeat
    settle : largest settling error of any family of outputs, over its alternating part
    crank, bearings, big_ends, block, pistons : fidelity levels; ``auto`` follows the engine and the other levels
    damper : True for the engine's torsional damper on the pulley
    film_temperature, damper_temperature : ``engine`` by its speed, or ``heat-balance``; of films also ``adiabatic``
    load_torque_nm : frees the dynamometer and loads it with this torque, a number, or an array or a function of its
        angle and speed (:mod:`cranktrain.dynamics.load_torque`)
    axial_force_n : steady axial force on the flywheel, positive away from the pulley; None: from the engine's axial
        path
    integrator : name; None: the usual one of the bearing level
    step_deg : internal step in degrees of crank angle
    tolerance : permissible error per step, for which ``step_deg`` is divided; None: constant steps
    load : fraction of the full-load burn
    pressure, pressure_unit, pressure_tdc_deg : file of a measured trace, folder or index file of traces over speed
        (:mod:`cranktrain.loads.pressure_map`), or an array or a function (:mod:`cranktrain.loads.given_pressure`);
        their unit, the angle of firing dead centre
    encoder : place whose angle these pressures belong to: each cylinder's own ``pin``, ``pulley`` or ``flywheel``
    mesh, block_mesh : the user's own meshes of crankshaft and block
    mesh_unit : of their coordinates: m, mm or in
    """

    speed_rpm: words.Speed
    cycles: words.Cycles | None = None
    settle: words.Settle = TOLERANCE
    crank: words.Crank = "solid"
    bearings: words.Mains = "auto"
    big_ends: words.BigEnds = "rigid"
    block: words.RunBlock = "auto"
    pistons: words.Guidance = "auto"
    damper: bool = False
    film_temperature: words.FilmTemperature = "engine"
    damper_temperature: words.DamperTemperature = "engine"
    load_torque_nm: words.Torque | LoadTorque | None = None
    axial_force_n: words.AxialForce | None = None
    integrator: words.Method | None = None
    step_deg: words.Step | None = None
    tolerance: float | None = None
    load: words.Share = 1.0
    pressure: words.Pressure | None = None
    pressure_unit: str | None = None
    pressure_tdc_deg: words.DeadCentre | None = None
    encoder: words.EncoderPlace = "pin"
    mesh: str | Path | MeshFile | None = None
    block_mesh: str | Path | MeshFile | None = None
    mesh_unit: str = "m"

    def __post_init__(self) -> None:
        """Set the unit of the meshes, and read a load torque from a script; ``InputError`` for wrong values."""
        if self.load_torque_nm is not None and not isinstance(self.load_torque_nm, int | float | LoadTorque):
            object.__setattr__(self, "load_torque_nm", LoadTorque(self.load_torque_nm))
        for name in ("mesh", "block_mesh"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, MeshFile(getattr(self, name), self.mesh_unit))

    @property
    def speed(self) -> float:
        """Speed, rad/s."""
        return self.speed_rpm * RPM

    def settings(self, engine: Engine, label: Callable[[str], str] = str) -> Settings:
        """Complete settings; ``label`` gives the user's name of a field.

        Raises ``InputError`` for unknown words, values out of bounds, contradictory choices, and parts that the engine
        lacks.
        """
        self.check(label)
        levels = Settings(
            crank=self.crank,
            bearings=self.bearings,
            big_ends=self.big_ends,
            block=self.block,
            pistons=self.pistons,
            damper="fitted" if self.damper else "none",
        )
        settings = checked(engine, self.of_a_run(levels), self.mesh, self.block_mesh)
        self.check_heat(settings, label)
        return settings

    def check(self, label: Callable[[str], str] = str) -> None:
        """Raise ``InputError`` for values that are invalid for every engine."""
        for one in fields_of(Request):
            one.refuse(getattr(self, one.name), label(one.name))
        if self.encoder != "pin" and self.pressure is None:
            raise InputError(f"{label('encoder')} {self.encoder} needs {label('pressure')}, a trace that was measured")
        if self.block_mesh is not None and self.block != "flexible":
            raise InputError(f"{label('block_mesh')} needs {label('block')} flexible; on ground there is no block")

    def check_heat(self, settings: Settings, label: Callable[[str], str] = str) -> None:
        """Raise ``InputError`` for a heat balance of parts for which heat is not computed."""
        if self.damper_temperature != "engine" and settings.damper == "none":
            raise InputError(f"{label('damper_temperature')} needs {label('damper')}; without a damper there is none")
        if self.film_temperature == "engine":
            return
        if not bearing_law(settings.bearings).carries:
            raise InputError(
                f"{label('film_temperature')} {self.film_temperature} needs films, and bearing level "
                f"'{settings.bearings}' has none"
            )
        check_level(settings.bearings)

    def of_a_run(self, levels: Settings) -> Settings:
        """Settings with these levels, and the load, integrator and steps of the request."""
        choices: dict[str, Any] = {"film_temperature": self.film_temperature}
        if self.load_torque_nm is not None:
            choices["boundary"] = "torque"
        if self.axial_force_n is not None:
            choices["axial_force"] = self.axial_force_n
        if self.encoder != "pin":
            choices["encoder"] = self.encoder
        if self.load != 1.0:
            choices["gas_load"] = self.load
        if self.integrator is not None:
            choices["integrator"] = self.integrator
        if self.step_deg is not None:
            choices["step"] = math.radians(self.step_deg)
        if self.tolerance is not None:
            choices |= {"control": "adaptive", "tolerance": self.tolerance}
        return replace(levels, **choices)

    def gas(self, engine: Engine, label: Callable[[str], str] = str, speeds_rpm: Sequence[float] = ()) -> Gas | None:
        """Measured pressures, or None for the built-in trace; ``InputError``.

        Warns of speeds and a load outside the range of the pressures; empty ``speeds_rpm`` stands for the own speed.
        """
        if self.pressure is not None:
            from cranktrain.loads.pressure_map import read_gas

            gas = read_gas(self.pressure, engine, self.pressure_unit, self.pressure_tdc_deg)
            gas.tell_ends([rpm * RPM for rpm in speeds_rpm or (self.speed_rpm,)], self.load)
            return gas
        if self.pressure_unit or self.pressure_tdc_deg is not None:
            raise InputError(
                f"{label('pressure_unit')} and {label('pressure_tdc_deg')} need {label('pressure')} FILE.csv"
            )
        return None

    def tell_doubts(self, engine: Engine, gas: Gas | None) -> GasTrace:
        """Warn if the gas takes work, nothing burns, or the load drives the engine. Return the pressure trace."""
        used = (gas or GasTrace.from_engine(engine)).at(self.speed, self.load)
        load = self.load_torque_nm
        if isinstance(load, LoadTorque):
            load = load.mean(self.speed * torsional_line(engine).end_speed)
        for text in run_doubts(engine, used, self.speed, self.load, load):
            warnings.warn(f"{engine.name}: {text}", stacklevel=3)
        return used

    def run(
        self,
        made: Assembly,
        gas: Gas | None = None,
        progress: Callable[[float], None] | None = None,
        say: Callable[[str], None] | None = None,
        sink: Sink | None = None,
    ) -> Run:
        """Run the cycles; ``progress`` gets the completed fraction, ``say`` the cycles and the settling error.

        With a ``sink`` the samples are written to it, and the run contains only its last cycles. Raises ``InputError``,
        ``SolverError``.
        """
        used = self.tell_doubts(made.engine, gas)
        result = simulation.simulate(
            made.engine, made.body, self._precise(made), self.speed, self.cycles, gas, progress, made.parts,
            damper_balance=self.damper_temperature == "heat-balance",
            load_torque=self.load_torque_nm, settle=self.settle, say=say, sink=sink,
        )  # fmt: skip
        attributes = self.attributes(made) | result.settling.attributes
        return Run(**vars(result), engine=made.engine, gas=used, attributes=attributes)

    def _precise(self, made: Assembly) -> Settings:
        """Settings with films in double precision, if the settling error requires it."""
        settings = made.settings
        levels = [settings.bearings, settings.big_ends]
        levels += [table.film.level for table in made.engine.additions.connection if table.film is not None]
        in_lanes = any(bearing_law(level).oil for level in levels)
        if self.cycles is not None or self.settle > SETTLED_IN_SINGLES or not in_lanes:
            return settings
        from cranktrain.film.laws.film_solution import IN_DOUBLES

        return replace(settings, newton_tolerance=min(settings.newton_tolerance or IN_DOUBLES, IN_DOUBLES))

    def attributes(self, made: Assembly) -> dict[str, str | int | float]:
        """Choices of the run as attributes of a result file."""
        settings = made.settings
        choices = ("crank", "bearings", "big_ends", "block", "pistons", "boundary", "damper")
        return {
            "body_digest": made.body.digest,
            "speed": self.speed,
            **{key: getattr(settings, key) for key in choices},
            "axial_force": axial_force(settings, made.engine),
            "film_temperature": self.film_temperature,
            "damper_temperature": self.damper_temperature,
            **({"encoder": self.encoder} if self.encoder != "pin" else {}),
            "integrator": settings.integrator,
            "step": settings.step,
            "control": settings.control,
            "tolerance": settings.tolerance if settings.control == "adaptive" else 0.0,
        }
