"""The page of ``cranktrain explore`` inside a notebook: ``ct.explore``."""

from pathlib import Path
from typing import Any

from cranktrain.cli.functions import verb
from cranktrain.engine.model import Engine
from cranktrain_lab.cli.explore import Explore

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
    from cranktrain_lab.cli.explore import explored_of

    explored = explored_of(engine, ask)
    import panel as pn

    from cranktrain_lab.explore.page import Page

    pn.extension(inline=True)
    return Explorer(Page(explored), explored.close)
