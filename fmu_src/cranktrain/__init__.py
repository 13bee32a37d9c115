"""Cranktrain: the dynamics of an engine's cranktrain, as a library and as an FMI co-simulation unit.

    import cranktrain as ct

    run = ct.simulate("diesel_i6", speed_rpm=2000)
    run["pulley.torsion"].to("deg"), run.orders("pulley.torsion"), run.plot()

Keywords carry engineering units (``speed_rpm``), everything inside is SI. Names are loaded when they are used.
"""

from __future__ import annotations

from importlib import import_module

from cranktrain import lab

TYPE_CHECKING = False
if TYPE_CHECKING:  # typing takes longer to load than all else that the command needs before it answers to signals
    from typing import Any

_VERBS = {
    "bearing_loads": ("bearing_loads", "BearingLoads"), "campbell": ("campbell", "CampbellDiagram"),
    "compare": ("compare", "Compare"),
    "damper_optimum": ("damper", "DamperOptimum"), "export": ("export", "Export"), "fatigue": ("fatigue", "Fatigue"),
    "film_table": ("film_table", "FilmTable"), "modal": ("modal", "Modal"), "new_engine": ("new", "NewEngine"),
    "picture": ("picture", "Picture"), "plan": ("plan", ""), "plot": ("plot", "Plot"), "reduce": ("reduce", "Reduce"),
    "report": ("report", "Report"), "roller": ("roller", "Roller"), "run_scene": ("plan", "RunScene"),
    "runup": ("runup", "Runup"), "simulate": ("simulate", "Simulate"), "stress": ("stress", "Stress"),
}  # fmt: skip
"""Functions of verbs, the modules that hold them, and their questions."""
NAMES = {
    **{name: f"cli.{module}" for name, (module, _) in _VERBS.items()},
    **{question: f"cli.{module}" for module, question in _VERBS.values() if question},
    "Assembly": "structure.assembly",
    "Body": "dynamics.topology.values",
    "Connection": "dynamics.topology.values",
    "End": "dynamics.topology.values",
    "Engine": "engine.model",
    "Frame": "dynamics.topology.values",
    "Topology": "dynamics.topology.values",
    "Bearing": "film.steady.plain_bearing",
    "CranktrainError": "core.errors",
    "InputError": "core.errors",
    "Slider": "dynamics.topology.values",
    "Settings": "dynamics.model.settings",
    "SolverError": "core.errors",
    "assemble": "cli.assembling",
    "build_fmu": "fmu.build",
    "engines": "cli.assembling",
    "film_tables": "structure.assembly",
    "law": "dynamics.topology.own_law",
    "load_engine": "engine.file",
    "load_run": "results.views.loaded",
    "load_scene": "studies.scene",
    "rigid_body": "core.reduced_body",
    "topology_modes": "structure.in_motion.topology_modes",
    **lab.NAMES,
}
"""Names of the library and the modules that hold them, those of the laboratory in full."""

_FORMER = {"calibrate": "identify", "plot_runup": "plot"}
"""Names before the first release, and those of now."""
__all__ = ["__version__", *NAMES]


def _installed_version() -> str:
    """Version of the installation, which its build took from the tags; ``0+unknown`` for sources on a bare path."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("cranktrain")
    except PackageNotFoundError:
        return "0+unknown"


def __getattr__(name: str) -> Any:
    """Load a name of the library at its first use."""
    if name == "__version__":
        globals()[name] = _installed_version()
        return globals()[name]
    if name not in NAMES:
        now = f"; it is called {_FORMER[name]} now" if name in _FORMER else ""
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'{now}")
    module = import_module(NAMES[name] if name in lab.NAMES else f"{__name__}.{NAMES[name]}")
    value = getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Names of the library."""
    return sorted(__all__)
