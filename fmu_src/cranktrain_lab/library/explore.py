"""The page of ``cranktrain explore`` inside a notebook: ``ct.explore``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cranktrain.cli.library.calling import of_verb
from cranktrain.core.errors import InputError, shown
from cranktrain.engine.model import Engine
from cranktrain.fmu.native.first_use import made_at_first_use
from cranktrain.store.waits import LINES


class Explorer:
    """A page for a notebook, which shows it where it stands last in a cell.

    Attributes
    ----------
    view : Panel object of the page, for pages of one's own
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


@of_verb
def explore(
    engine: str | Path | Engine, *, from_rpm: float | None = None, to_rpm: float | None = None,
    measured: str | Path | None = None, compare: str | Path | None = None, inside: str | Path | None = None,
    balance: bool = True,
) -> Explorer:  # fmt: skip
    """Knobs that turn an engine's torsional vibration, in a notebook; needs the extra ``explore``.

    Raises ``InputError`` for what cannot be used, and for a package that is missing.

        page = ct.explore("diesel_i6")
        page                # last in a cell: the page
        page.engine         # the engine as the knobs stand

    Parameters
    ----------
    engine : name, path, or in memory
    from_rpm, to_rpm : ends of the speed range, rev/min; as the engine has them
    measured : file of measured orders
    compare : engine, or result file of a run-up, that is shown beside
    inside : file of a cycle to look into, or result file of ``simulate``
    balance : whether harmonic balance follows when a knob rests
    """
    from cranktrain_lab.cli.explore import explored_of

    for name, end in (("from_rpm", from_rpm), ("to_rpm", to_rpm)):
        if end is not None and (isinstance(end, bool) or not isinstance(end, int | float)):
            raise InputError(f"explore: {name} is {shown(end)}; give a number in rev/min")
    options = argparse.Namespace(
        from_rpm=from_rpm, to_rpm=to_rpm, measured=measured, balance=balance,
        compare=None if compare is None else str(compare), inside=None if inside is None else str(inside),
    )  # fmt: skip
    said = LINES.set(False)
    try:
        with made_at_first_use():
            explored = explored_of(engine, options)
    finally:
        LINES.reset(said)
    import panel as pn

    from cranktrain_lab.explore.page import Page

    pn.extension(inline=True)
    return Explorer(Page(explored), explored.close)
