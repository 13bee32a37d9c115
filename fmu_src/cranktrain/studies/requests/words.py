"""Options of requests, one type alias for each, and groups of options that several verbs share."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.dynamics.model.settings import FILM_TEMPERATURES, TEMPERATURES
from cranktrain.dynamics.settled.judging import FREE_CYCLES, MOST_CYCLES, TOLERANCE
from cranktrain.dynamics.time.integrators import INTEGRATORS, integrator_table, settles_films
from cranktrain.engine.levels import BLOCKS, CRANKS, ENCODERS, PISTONS, described
from cranktrain.engine.model import Engine
from cranktrain.engine.quantities import FASTEST_RPM, SLOWEST_RPM
from cranktrain.film.laws.register import BIG_END, LAWS, MAINS, Law, bearing_levels
from cranktrain.structure.fem.own_mesh import UNITS
from cranktrain.studies.requests.fields import Given, Option, Question

if TYPE_CHECKING:
    from cranktrain.dynamics.load_torque import LoadValues
    from cranktrain.loads.given_pressure import Pressures as PressureValues
else:
    LoadValues = PressureValues = object  # what scripts give is checked where it is read

BALANCED = "balanced"
"""Word for a load at which the burn balances the engine file's ``[load]``."""
HIGHEST_ORDER = 1000.0
"""Highest order of a run-up."""
OWN_MESH = (
    "own mesh (.msh, .inp, .unv, .bdf) with named journal surfaces; for --crank torsional also a table of discs and "
    "shafts (.csv, .toml): pulley, flywheel and pin[1] …, or main[1] … between which the pins turn"
)
_SOURCES = "engine (default), by its speed; or heat-balance"


def _laws(*kinds: str) -> str:
    return described(LAWS[name] for name in bearing_levels(*kinds))


def orders_of(orders: "OrdersOf") -> tuple[float, ...]:
    """Orders of a question, as :func:`order_list` has read them."""
    return order_list(orders) if isinstance(orders, str) else tuple(orders)


def mains() -> tuple[str, ...]:
    """Levels of main bearings, including those that a script has registered."""
    return ("auto", *bearing_levels(*MAINS))


def big_ends() -> tuple[str, ...]:
    """Levels of big-end bearings, including those that a script has registered."""
    return tuple(bearing_levels(BIG_END))


BIG_ENDS = _laws(BIG_END)


def _integrators() -> str:
    others = [f"at level {law.name} {law.integrator}" for law in LAWS.values() if law.integrator != Law.integrator]
    lost = ", ".join(name for name in INTEGRATORS if not settles_films(name))
    return f"{', '.join(INTEGRATORS)}; default {', '.join((Law.integrator, *others))}; elastic films refuse {lost}"


def _steps() -> str:
    others = [f"at level {law.name} {law.step_deg:g}" for law in LAWS.values() if law.step_deg != Law.step_deg]
    return f"internal step in degrees of crank angle; default {', '.join((f'{Law.step_deg:g}', *others))}"


def _method(name: str) -> str:
    """Checked name of an integrator, with an optional parameter as in ``hht:-0.2``; ``InputError``."""
    try:
        integrator_table(name)
    except InputError as error:  # the field's name stands before it
        raise InputError(str(error).removeprefix("integrator ")) from None
    return name


def order_list(text: str) -> tuple[float, ...]:
    """Orders from a text, multiples of ½ separated by commas; sorted, without repetition. ``InputError``."""
    if not text.strip():
        return ()
    try:
        orders = [float(word) for word in text.split(",")]
    except ValueError:
        raise InputError(f"'{text}' is no list of orders; give numbers, e.g. 4.5,6") from None
    for order in orders:
        if not (0.5 <= order <= HIGHEST_ORDER and (2.0 * order).is_integer()):
            raise InputError(f"order {order:g} is not a multiple of 0.5 up to {HIGHEST_ORDER:g}")
    return tuple(sorted(set(orders)))


File = str | Path
CrankWord = Literal["rigid", "torsional", "beam", "solid"]
MainsWord = Literal["auto", "held", "linear", "impedance", "table", "reynolds", "ehd", "ehd:fine", "roller"]
BigEndWord = Literal["rigid", "impedance", "table", "ehd", "ehd:fine"]
Crank = Annotated[
    CrankWord,
    Option("LEVEL", f"{described(CRANKS.values())}; default {{default}}", words=CRANKS.keys),
]
Mains = Annotated[
    MainsWord,
    Option(
        "LEVEL",
        lambda: f"{_laws(*MAINS)}; default impedance, roller where the mains are rollers, held at --crank torsional",
        words=mains,
    ),
]
BigEnds = Annotated[
    BigEndWord,
    Option("LEVEL", f"{BIG_ENDS}; default {{default}}", words=big_ends),
]
RunBlock = Annotated[
    Literal["auto", "ground", "flexible"],
    Option(
        "LEVEL",
        f"{described(BLOCKS.values())}; default ground, flexible where the mains are rollers",
        words=("auto", *BLOCKS),
    ),
]
Block = Annotated[
    Literal["ground", "flexible"],
    Option("LEVEL", f"{described(BLOCKS.values())}; default ground", words=BLOCKS.keys),
]
Guidance = Annotated[
    Literal["auto", "rigid", "guided"],
    Option(
        "LEVEL", f"{described(PISTONS.values())}; default rigid, in a flexible block guided",
        words=("auto", *PISTONS),
    ),
]  # fmt: skip
EngineFile = Annotated[
    File | Engine, Option("ENGINE", "name of a shipped engine or path of a .toml file", place=True)
]  # fmt: skip
Fitted = Annotated[bool, Option(help="with the engine's torsional damper on the pulley")]
Share = Annotated[
    float, between(0.0, 2.0, "of the full-load burn"), Option("SHARE", "fraction of the full-load burn (default 1)")
]
BalancedShare = Annotated[
    float | Literal["balanced"],
    between(0.0, 2.0, "of the full-load burn"),
    Option(
        "SHARE",
        f"fraction of the full-load burn, or '{BALANCED}': the burn whose mean torque is that of the engine file's "
        f"[load] (default: {BALANCED} where the file has [load], else 1)",
    ),
]
Rpm = Annotated[float, between(SLOWEST_RPM, FASTEST_RPM, "rev/min")]
FirstSpeed = Annotated[Rpm, Option("RPM", "first speed, rev/min (default: the engine's lowest)", "--from")]
LastSpeed = Annotated[Rpm, Option("RPM", "last speed, rev/min (default: the engine's highest)", "--to")]
Speed = Annotated[
    float,
    between(SLOWEST_RPM, FASTEST_RPM, "rev/min; for less use the FMU, which takes any speed from 0"),
    Option("RPM", "rev/min, at least 20", "--speed"),
]
Cycles = Annotated[
    int,
    between(1, 10000, "cycles"),
    Option(
        "N",
        f"exactly this many cycles of 720 degrees (default: until the outputs repeat, at most {MOST_CYCLES}; "
        f"{FREE_CYCLES} with --load-torque-nm); the last one is evaluated",
    ),
]
Settle = Annotated[
    float,
    between(1e-8, 0.5, "of the outputs' alternating part"),
    Option("TOL", "run until the settling error of every output family is below this (default {default})"),
]
LineTable = Annotated[
    File,
    Option("TABLE", "discs and shafts (TOML or CSV) from 'flywheel' to 'dynamometer' in place of the connecting shaft"),
]
Pressure = Annotated[
    File | Annotated[
        PressureValues,
        Given(
            "or an array over one cycle (Pa), (angle, pressure), a dict by cylinder, or a function of the crank angle "
            "(rad) and the speed (rad/s)"
        ),
    ],
    Option(
        "FILE",
        "measured pressures: a .csv file of crank angle in degrees and pressure, one column or one for each cylinder; "
        "or a folder of such files named by speed (1500.csv), or an index file of speed_rpm, load, file",
    ),
]  # fmt: skip
PressureUnit = Annotated[str, Option("UNIT", "Pa, kPa, bar or MPa (default: from header or size of the peak)")]
DeadCentre = Annotated[
    float,
    between(-7200.0, 7200.0, "deg of the file"),
    Option("DEG", "angle of the firing dead centre in the pressure file (of cylinder 1)"),
]
EncoderPlace = Annotated[
    Literal["pin", "pulley", "flywheel"],
    Option(
        "PLACE",
        "place whose angle the pressures of --pressure belong to: pulley or flywheel, where the encoder of the "
        "measurement sat, or pin (default), each cylinder's own crank pin",
        words=ENCODERS,
    ),
]
Torque = Annotated[float, between(-1e6, 1e6, "N m")]
LoadTorque = Annotated[
    Torque | Annotated[
        LoadValues,
        Given("or an array over 720 degrees, or a function of the loaded end's angle (rad) and speed (rad/s)"),
    ],
    Option(
        "TORQUE",
        "load the dynamometer with this torque instead of holding its speed; --speed is the initial speed",
    ),
]  # fmt: skip
AxialForce = Annotated[
    float,
    between(-1e6, 1e6, "N"),
    Option("N", "steady axial force on the flywheel, positive away from the pulley (default: the engine file's)"),
]
DamperTemperature = Annotated[
    Literal["engine", "heat-balance"],
    Option("SOURCE", f"{_SOURCES}, from the damper's own losses", words=TEMPERATURES),
]
FilmTemperature = Annotated[
    Literal["engine", "heat-balance", "adiabatic"],
    Option(
        "SOURCE",
        f"temperature of the main bearings' oil: {_SOURCES} or adiabatic, each film warmed by its own friction (the "
        "run repeats, at most 6 times; big ends and thrust bearing stay at the engine's)",
        words=FILM_TEMPERATURES,
    ),
]
Method = Annotated[
    Literal[
        "backward-euler", "trapezoidal", "hht", "generalised-alpha", "bdf2", "tr-bdf2", "sdirk2", "sdirk3", "sdirk4",
        "esdirk3", "esdirk4", "esdirk5", "esdirk47", "esdirk57",
    ],
    Option("NAME", _integrators, words=INTEGRATORS.keys, convert=_method),
]  # fmt: skip
Step = Annotated[float, between(0.001, 30.0, "deg of crank angle"), Option("DEG", _steps)]
StepError = Annotated[
    float,
    Option("ERROR", "adaptive steps: --step-deg is divided until the error of a step is below this, e.g. 1e-4"),
]
OwnMesh = Annotated[
    File,
    Option(
        "FILE",
        OWN_MESH,
        also=(
            (
                "--body",
                "own reduced crankshaft in place of a mesh: .h5, .npz or folder of reduce --output, or a "
                "superelement of another program (.toml)",
            ),
        ),
    ),
]
MeshUnit = Annotated[
    Literal["m", "mm", "in"],
    Option("UNIT", f"unit of own meshes: {', '.join(UNITS)} (default m)", words=UNITS.keys),
]
OwnBlock = Annotated[
    File,
    Option(
        "FILE",
        "own block (.msh, .inp, .unv, .bdf) with named surfaces; needs --block flexible",
        also=(
            (
                "--block-body",
                "own reduced block in place of a mesh: .h5, .npz or folder of reduce --block-output, or a "
                "superelement of another program (.toml)",
            ),
        ),
    ),
]
Workers = Annotated[
    int, between(1, 1024, "processes"), Option("N", "processes (default: one a processor)", was="--jobs")
]
OrdersOf = str | Sequence[float]
Orders = Annotated[
    OrdersOf,
    Option(
        "LIST",
        "orders to be drawn, separated by commas, e.g. 4.5,6 (default: the strongest)",
        convert=order_list,
    ),
]


@dataclass(frozen=True, kw_only=True)
class MeshUnits(Question):
    """Unit of own meshes."""

    mesh_unit: MeshUnit = "m"


@dataclass(frozen=True, kw_only=True)
class Meshes(MeshUnits):
    """Own mesh or body of the crankshaft."""

    mesh: OwnMesh | None = None


@dataclass(frozen=True, kw_only=True)
class Settled(Question):
    """Limit of the settling error."""

    settle: Settle = TOLERANCE


@dataclass(frozen=True, kw_only=True)
class CrankLevel(Question):
    """Fidelity level of the crank."""

    crank: Crank = "solid"


@dataclass(frozen=True, kw_only=True)
class Levels(Question):
    """Fidelity levels of bearings, big ends and block, and the damper."""

    bearings: Mains = "auto"
    big_ends: BigEnds = "rigid"
    block: RunBlock = "auto"
    block_mesh: OwnBlock | None = None
    damper: Fitted = False


@dataclass(frozen=True, kw_only=True)
class PistonLevel(Question):
    """Fidelity level of the pistons."""

    pistons: Guidance = "auto"


@dataclass(frozen=True, kw_only=True)
class Load(Question):
    """Load of a run."""

    load: Share = 1.0


@dataclass(frozen=True, kw_only=True)
class DriveLine(Question):
    """Drive line in place of the engine file's."""

    drive_line: LineTable | None = None


@dataclass(frozen=True, kw_only=True)
class Pressures(DriveLine):
    """Measured pressures and a drive line that replace those of the engine file."""

    pressure: Pressure | None = None
    pressure_unit: PressureUnit | None = None
    pressure_tdc_deg: DeadCentre | None = None


@dataclass(frozen=True, kw_only=True)
class Encoder(Question):
    """Place of the encoder that gave the angles of measured pressures."""

    encoder: EncoderPlace = "pin"


@dataclass(frozen=True, kw_only=True)
class Running(CrankLevel, Levels, PistonLevel, Pressures, Encoder, Meshes):
    """Options of a run, except its speeds, length and written files."""

    load: BalancedShare | None = None
    inherit: Annotated[
        bool,
        Option(
            help="torsional crank with its structural damping alone, without damping inherited from the level above"
        ),
    ] = True
    axial_force_n: AxialForce | None = None
    damper_temperature: DamperTemperature = "engine"
    film_temperature: FilmTemperature = "engine"
    integrator: Method | None = None
    step_deg: Step | None = None
    tolerance: StepError | None = None


@dataclass(frozen=True, kw_only=True)
class Charts(Question):
    """Options for charts of orders over the speed."""

    orders: Orders = ()
    log: Annotated[
        bool,
        Option(
            help="amplitudes on a logarithmic scale (default: where resonances are below a twentieth of the largest)"
        ),
    ] = False
    linear: Annotated[bool, Option(help="amplitudes on a linear scale whatever they are")] = False
    peak_to_peak: Annotated[bool, Option(help="amplitudes peak to peak in place of zero to peak")] = False

    @property
    def logarithmic(self) -> bool | None:
        """True for a logarithmic scale, None for a scale that suits the data; ``InputError`` for both options."""
        if self.log and self.linear:
            raise InputError("--log and --linear ask for two scales; leave one of them out")
        return True if self.log else False if self.linear else None
