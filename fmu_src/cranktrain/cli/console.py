"""What the command line shows: tables on stdout, progress and remarks on stderr; and checks of its options."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table as RichTable

from cranktrain.core.errors import InputError, nearest

_LEFT = ("shape", "to which number", "value", "unit or norm")


class Interrupted(KeyboardInterrupt):
    """An interrupt that says what was kept and how to go on, in one line."""


def within(option: str, value: float, low: float, high: float, what: str) -> None:
    """Refuse a number outside its bounds with ``InputError``; ``what`` is its unit, and what else serves."""
    if not (math.isfinite(value) and low <= value <= high):
        raise InputError(f"{option} {value:g} is not within {low:g} to {high:g} {what}")


def one_of(option: str, value: str, valid: Sequence[str]) -> None:
    """Refuse a word that is not among the valid ones with ``InputError`` that names the nearest."""
    if value not in valid:
        raise InputError(f"{option} '{value}' does not exist; {nearest(value, valid)}")


def say(text: str) -> None:
    """Print a line on stderr."""
    print(text, file=sys.stderr, flush=True)


def show(table: Any) -> None:
    """Print a table of texts on stdout."""
    show_rows(table.title, table.header, table.rows)


def show_rows(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table of texts, given by its parts, on stdout."""
    shown = RichTable(title=title, title_justify="left", title_style="bold")
    for column in header:
        shown.add_column(column, justify="left" if column in _LEFT else "right")
    for row in rows:
        shown.add_row(*row)
    Console(width=None if sys.stdout.isatty() else 120).print(shown)


@contextmanager
def stages(title: str) -> Iterator[Callable[[str], None]]:
    """Show the stage at work on stderr; lines where stderr is no terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda stage: say(f"{title}: {stage}")
        return
    with Progress(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console) as progress:
        task = progress.add_task(title, total=None)
        yield lambda stage: progress.update(task, description=f"{title}: {stage}")


@contextmanager
def bar(title: str) -> Iterator[Callable[[float], None] | None]:
    """Show a bar on stderr that follows a share in [0, 1]; nothing where stderr is no terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(title, total=1.0)
        yield lambda share: progress.update(task, completed=share)


@contextmanager
def labelled_bar(title: str) -> Iterator[tuple[Callable[[str], None], Callable[[float], None]]]:
    """Show a bar on stderr with what is at work: functions of a text, and of a share in [0, 1].

    Lines of text and share where stderr is no terminal.
    """
    console = Console(stderr=True)
    share = 0.0

    def follow(value: float) -> None:
        nonlocal share
        share = value

    if not console.is_terminal:
        yield lambda text: say(f"{title}: {100.0 * share:3.0f} %  {text}"), follow
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task(title, total=1.0)
        yield (
            lambda text: progress.update(task, description=f"{title}: {text[:70]}"),
            lambda value: progress.update(task, completed=value),
        )
