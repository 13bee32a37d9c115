"""Output of the command line: tables on stdout, progress and remarks on stderr."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from shutil import get_terminal_size
from typing import Any

from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table as RichTable

from cranktrain.core.visible_text import unfiltered, visible
from cranktrain.results.columns import pages
from cranktrain.store.waits import LINES, waits

USUAL_WIDTH = 120
"""Characters of a line if neither a terminal nor COLUMNS gives the number."""
BESIDE = 3
"""Characters that a column of a table takes in addition to its text."""
_LEFT = ("shape", "to which number", "value", "unit or norm", "verdict", "quantity", "expected")


class Interrupted(KeyboardInterrupt):
    """Interrupt with a message of one line: which results were kept, and how to continue.

    ``found`` is the result so far, which the command line shows, or None.
    """

    def __init__(self, text: str, found: Any = None) -> None:
        super().__init__(text)
        self.found = found


def say(text: str) -> None:
    """Print a line on stderr."""
    print(visible(text), file=sys.stderr, flush=True)


def show(table: Any) -> None:
    """Print a table of texts on stdout."""
    show_rows(table.title, table.header, table.rows)


def show_rows(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table of texts on stdout, without empty columns, and split into parts if it is too wide."""
    width = get_terminal_size((USUAL_WIDTH, 24)).columns
    rows = [tuple(map(visible, row)) for row in rows]
    for part, page in enumerate(pages(header, rows, width - 1, BESIDE, cell_len)):
        shown = RichTable()
        for k, size, heading in zip(page.columns, page.widths, page.header, strict=True):
            justify: JustifyMethod = "left" if header[k] in _LEFT else "right"
            shown.add_column(heading, justify=justify, width=size, overflow="fold")
        for row in page.rows:
            shown.add_row(*row)
        # Texts may be a user's: none of them is mark-up.
        whole = max(width, sum(page.widths) + BESIDE * len(page.widths) + 1)
        console = Console(file=unfiltered(sys.stdout), width=whole, markup=False, emoji=False, highlight=False)
        console.print(visible(f"{title}, continued" if part else title), style="bold")
        console.print(shown)


@contextmanager
def stages(title: str) -> Iterator[Callable[[str], None]]:
    """Show the current stage of a task on stderr, in one line that changes; in separate lines if it is no terminal."""
    with _drawn((title,), SpinnerColumn()) as update, waits(title) as told:

        def tell(stage: str) -> None:
            if update:
                update(title, stage=stage)
            elif LINES.get():
                say(f"{title}: {stage}")
            else:
                told.tell(stage)

        yield tell


@contextmanager
def bar(title: str) -> Iterator[Callable[[float], None] | None]:
    """Show a progress bar on stderr for a fraction in [0, 1]; occasional lines if stderr is no terminal."""
    with _drawn((title,), BarColumn()) as update, waits(title) as told:
        if update:
            yield lambda share: update(title, completed=share)
        else:
            told.tell("")
            yield told.follow


@contextmanager
def labelled_bar(title: str) -> Iterator[tuple[Callable[[str], None], Callable[[float], None]]]:
    """Show a progress bar with a label on stderr. Yields a function that sets the label, and one for the fraction done.

    If stderr is no terminal, lines with both are printed.
    """
    share = 0.0

    def tell(text: str) -> None:
        if update:
            update(title, stage=text[:70])
        elif LINES.get():
            say(f"{title}: {100.0 * share:3.0f} %  {text}")
        else:
            told.tell(text)

    def follow(value: float) -> None:
        nonlocal share
        share = value
        if update:
            update(title, completed=value)
        elif not LINES.get():
            told.follow(value)

    with _drawn((title,), BarColumn()) as update, waits(title) as told:
        if not update and not LINES.get():
            told.tell("")
        yield tell, follow


@contextmanager
def bars(title: str, names: Sequence[str]) -> Iterator[Callable[[str, str, float], None]]:
    """Show a progress bar for each name on stderr. Yields a function of name, stage and fraction done.

    If stderr is no terminal, a line is printed when a name is done.
    """

    def tell(name: str, stage: str, share: float) -> None:
        if update:
            update(name, stage=stage, completed=share)
        elif share >= 1.0 and LINES.get():
            say(f"{title}: {name} ({stage})")

    with _drawn(names, BarColumn()) as update:
        yield tell


@contextmanager
def _drawn(titles: Sequence[str], column: ProgressColumn) -> Iterator[Callable[..., None] | None]:
    """Draw a line for each title on a terminal. Yields a function of title and changed values; None if no terminal."""
    console = Console(file=unfiltered(sys.stderr))
    if not console.is_terminal:
        yield None
        return
    said, stage = (TextColumn(text, markup=False) for text in ("{task.description}", "{task.fields[stage]}"))
    columns = (said, column, stage, TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        total = None if isinstance(column, SpinnerColumn) else 1.0
        tasks = {title: progress.add_task(title, total=total, stage="") for title in titles}
        yield lambda title, **change: progress.update(tasks[title], **change)
