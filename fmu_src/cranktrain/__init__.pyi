"""Names of the library for editors and type checkers; written by ``python -m cranktrain.cli.library``."""

from cranktrain.cli.library.engines import assemble as assemble
from cranktrain.cli.library.engines import engines as engines
from cranktrain.cli.library.explore import explore as explore
from cranktrain.cli.library.functions.analyse_measured import analyse_measured as analyse_measured
from cranktrain.cli.library.functions.bearing_loads import bearing_loads as bearing_loads
from cranktrain.cli.library.functions.calibrate import calibrate as calibrate
from cranktrain.cli.library.functions.campbell import campbell as campbell
from cranktrain.cli.library.functions.couple import couple as couple
from cranktrain.cli.library.functions.damper_optimum import damper_optimum as damper_optimum
from cranktrain.cli.library.functions.export import export as export
from cranktrain.cli.library.functions.fatigue import fatigue as fatigue
from cranktrain.cli.library.functions.film_table import film_table as film_table
from cranktrain.cli.library.functions.harness import harness as harness
from cranktrain.cli.library.functions.modal import modal as modal
from cranktrain.cli.library.functions.new_engine import new_engine as new_engine
from cranktrain.cli.library.functions.picture import picture as picture
from cranktrain.cli.library.functions.plan import plan as plan
from cranktrain.cli.library.functions.plot_runup import plot_runup as plot_runup
from cranktrain.cli.library.functions.reduce import reduce as reduce
from cranktrain.cli.library.functions.report import report as report
from cranktrain.cli.library.functions.roller import roller as roller
from cranktrain.cli.library.functions.run_in import run_in as run_in
from cranktrain.cli.library.functions.run_scene import run_scene as run_scene
from cranktrain.cli.library.functions.runup import runup as runup
from cranktrain.cli.library.functions.simulate import simulate as simulate
from cranktrain.cli.library.functions.stability import stability as stability
from cranktrain.cli.library.functions.stress import stress as stress
from cranktrain.cli.library.functions.tradeoff import tradeoff as tradeoff
from cranktrain.cli.library.variants import optimize as optimize
from cranktrain.cli.library.variants import vary as vary
from cranktrain.core.errors import CranktrainError as CranktrainError
from cranktrain.core.errors import InputError as InputError
from cranktrain.core.errors import SolverError as SolverError
from cranktrain.core.reduced_body import rigid_body as rigid_body
from cranktrain.dynamics.model.settings import Settings as Settings
from cranktrain.dynamics.topology.modes import topology_modes as topology_modes
from cranktrain.dynamics.topology.own_law import law as law
from cranktrain.dynamics.topology.values import Body as Body
from cranktrain.dynamics.topology.values import Connection as Connection
from cranktrain.dynamics.topology.values import End as End
from cranktrain.dynamics.topology.values import Frame as Frame
from cranktrain.dynamics.topology.values import Slider as Slider
from cranktrain.dynamics.topology.values import Topology as Topology
from cranktrain.engine.file import load_engine as load_engine
from cranktrain.engine.model import Engine as Engine
from cranktrain.film.steady.plain_bearing import Bearing as Bearing
from cranktrain.fmu.build import build_fmu as build_fmu
from cranktrain.measured.reading import read_measured as read_measured
from cranktrain.results.in_hand.loaded import load_run as load_run
from cranktrain.results.variants.variants import Variants as Variants
from cranktrain.structure.assembly import Assembly as Assembly
from cranktrain.structure.assembly import film_tables as film_tables
from cranktrain.studies.scene import load_scene as load_scene

__version__: str
NAMES: dict[str, str]
