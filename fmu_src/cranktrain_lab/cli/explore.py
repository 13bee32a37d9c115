"""The verb ``explore``: a local page with controls that change an engine and show its torsional vibration."""

import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cranktrain.cli.console import say, stages
from cranktrain.cli.functions import verb
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.core.user_file import ending
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question

if TYPE_CHECKING:
    from cranktrain_lab.explore.page import Explored

DESCRIPTION = """\
A local page where knobs turn an engine's torsional vibration, and curves follow at once.

Knobs of load, firing order, damper, pulley, flywheel and shafts, as the engine file has them. Orders of the pulley's
torsion, twist, Campbell diagram and damper heat follow as a knob moves (linear run-up of a torsional crank), harmonic
balance when it rests. A full model runs in the background. What was changed is written into a new engine file.

The page is served to this machine alone (127.0.0.1), at an address with a token that is printed; it asks nothing of any
network. Ctrl-C ends it (exit code 0). Needs the extra explore: pip install cranktrain[explore].
"""


@dataclass(frozen=True, kw_only=True)
class Explore(Question):
    """Contents of a page in a notebook or a browser."""

    from_rpm: words.FirstSpeed | None = None
    to_rpm: words.LastSpeed | None = None
    measured: Annotated[
        words.File | None,
        Option("FILE", "measured orders, laid over the computed ones; table of 'cranktrain measured' or UFF 58"),
    ] = None
    compare: Annotated[
        words.File | None, Option("OTHER", "engine or result file of runup (.h5) that is shown beside")
    ] = None
    inside: Annotated[
        words.File | None, Option("FILE", "cycle to look into: saved by the page, or a result file of simulate (.h5)")
    ] = None
    balance: Annotated[bool, Option(help="without harmonic balance when a knob rests")] = True


@dataclass(frozen=True, kw_only=True)
class ExplorePage(Explore):
    """Question of :func:`explore_page`."""

    port: Annotated[int, between(0, 65535, ""), Option("N", "port (default: a free one)")] = 0
    browser: Annotated[bool, Option(help="open the page in the browser")] = False


@verb(ExplorePage, DESCRIPTION)
def explore_page(engine: str | Path | Engine, ask: ExplorePage) -> VerbResult:
    """Serve the page until it is ended by Ctrl-C, its normal end."""
    explored = explored_of(engine, ask)
    from cranktrain_lab.explore.server import serve

    address = ""

    def started(found: str) -> None:
        nonlocal address
        address = found
        if "--json" in sys.argv:  # standard output is for one object
            say(found)
        else:
            print(f"{found}\nCtrl-C ends it.", flush=True)
        if ask.browser:
            import webbrowser

            webbrowser.open(found)

    try:
        serve(explored, ask.port, started)
    except KeyboardInterrupt as stop:
        if signal.SIGTERM in stop.args:
            raise
    say("cranktrain: explore ended")  # Panel may take the signal, and end the server by itself
    return VerbResult.of({"address": address}, "explore")


def show(found: VerbResult) -> None:
    """Print nothing, because the address was printed when the page began."""


def explored_of(source: str | Path | Engine, ask: Explore) -> "Explored":
    """Contents of the page; the input is checked before any work; ``InputError``."""
    engine = load_engine(source)
    if isinstance(source, Engine):
        source = engine
    try:
        from cranktrain_lab.explore.page import Explored
    except ImportError as error:
        missing = (error.name or "panel").partition(".")[0]
        raise InputError(f"explore needs {missing}; pip install cranktrain[explore]") from None
    from cranktrain.results.orders.deviations import check_speeds_measured
    from cranktrain.results.orders.measured import read_measured_orders
    from cranktrain_lab.explore.balance import Balance
    from cranktrain_lab.explore.knobs import Chosen
    from cranktrain_lab.explore.live import LiveTorsion, checked_speeds

    ends = checked_speeds(engine, ask.from_rpm, ask.to_rpm)
    measured = None if ask.measured is None else read_measured_orders(ask.measured)
    if measured is not None:
        check_speeds_measured(measured, *ends)
    other = _other(ask.compare, ends)
    from cranktrain_lab.explore.inside.cycle import InsideCycle

    inside = None if ask.inside is None else InsideCycle.load(ask.inside, engine)
    with stages(engine.name) as tell:
        live = LiveTorsion(engine, *ends, say=tell)
        for note in live.notes:
            say(f"cranktrain: note: {note}")
        beside = other if other is None or not isinstance(other[1], Engine) else (
            other[0], LiveTorsion(other[1], *ends, say=tell).answer(Chosen()))  # fmt: skip
    return Explored(source, live, measured, Balance(live) if ask.balance else None, beside, inside)


def _other(given: str | Path | None, ends: tuple[float, float]) -> Any:
    """Title of the other engine or run-up for comparison, and the engine or run-up itself."""
    if given is None:
        return None
    if ending(given) != ".h5":
        engine = load_engine(given)
        return engine.title, engine
    from cranktrain.results.run_up.run_up import RunUp

    found = RunUp.load(given)
    inside = (found.speeds >= ends[0]) & (found.speeds <= ends[1])
    if not inside.any():
        raise InputError(f"--compare {given}: has no speed within those of the page; give --from and --to")
    return f"{found.attributes.get('engine', given)}, {given}", found


ABOUT = """\
Knobs that turn an engine's torsional vibration, in a notebook; needs the extra ``explore``.

    page = ct.explore("diesel_i6")
    page                # last in a cell: the page
    page.engine         # the engine as the knobs stand
"""


class Explorer:
    """Page for a notebook, which is shown if it is the last expression of a cell.

    Attributes
    ----------
    view : Panel object of the page, for use in a user's own page
    """

    def __init__(self, page: Any, close: Any) -> None:
        self._page, self.view, self.close, self._looking = page, page.view, close, False

    @property
    def engine(self) -> Engine:
        """The engine as the knobs stand."""
        found: Engine = self._page.engine()
        return found

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> Any:
        import panel as pn

        from cranktrain_lab.explore.page import POLL_MS

        if not self._looking:
            pn.state.add_periodic_callback(self._page.look, POLL_MS)
            self._looking = True
        return self.view._repr_mimebundle_(include, exclude)

    def __repr__(self) -> str:
        return f"Explorer of '{self.engine.name}': show it in a notebook, or use 'cranktrain explore'"


@verb(Explore, ABOUT)
def explore(engine: str | Path | Engine, ask: Explore) -> Explorer:
    """Knobs in a notebook."""
    explored = explored_of(engine, ask)
    import panel as pn

    from cranktrain_lab.explore.page import Page

    pn.extension(inline=True)
    return Explorer(Page(explored), explored.close)
