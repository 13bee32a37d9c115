"""Help of the command line as a page: the parsers' own texts, laid out so that nothing is cut off at any width."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from itertools import groupby

ALIGNED = re.compile(r"^\s|\S {2,}\S")
"""A line that is arranged by hand."""
WIDTH = 80


def page() -> str:
    """Sections of all verbs."""
    sections = [f"## cranktrain {name}\n\n{of_parser(parser)}" for name, parser in verbs()]
    head = "# Command line\n\nEach section is the verb's own `--help`. `cranktrain --help` lists the verbs:\n\n"
    names = "".join(
        f"| [{name}](#cranktrain-{'-'.join(name.split())}) | {_cell(_first(parser))} |\n" for name, parser in verbs()
    )  # fmt: skip
    return f"{head}| verb | |\n| --- | --- |\n{names}\n" + "\n".join(sections)


def verbs() -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Every verb of ``cranktrain`` with its parser."""
    from cranktrain.cli.main import _parser
    from cranktrain.cli.verbs import VERBS

    choices = _choices(_parser(*VERBS))
    for name in VERBS:
        family, _, kind = name.partition(" ")
        yield name, _choices(choices[family])[kind] if kind else choices[name]


def _choices(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Parsers of a parser's verbs by name."""
    return next(dict(one.choices) for one in parser._actions if isinstance(one, argparse._SubParsersAction))


def of_parser(parser: argparse.ArgumentParser) -> str:
    """Description, usage and options of a parser."""
    shape = argparse.HelpFormatter(parser.prog, width=WIDTH)
    shape.add_usage(parser.usage, parser._actions, parser._mutually_exclusive_groups, prefix="")
    parts = [_prose(parser.description or ""), f"```text\n{shape.format_help().strip()}\n```"]
    for group in parser._action_groups:
        shown = [one for one in group._group_actions if one.help is not argparse.SUPPRESS and one.dest != "help"]
        if shown:
            rows = [
                (shape._format_action_invocation(one), shape._expand_help(one) if one.help else "") for one in shown
            ]
            parts += [_prose(group.description or ""), _table(group.title or "", rows)]
    return "\n\n".join(part for part in [*parts, _prose(parser.epilog or "")] if part) + "\n"


def _first(parser: argparse.ArgumentParser) -> str:
    return (parser.description or "").strip().partition("\n")[0]


def _prose(text: str) -> str:
    """Paragraphs; runs of lines that are arranged by hand stay as they are."""
    found = []
    for part in re.split(r"\n\s*\n", text.strip("\n")):
        for arranged, run in groupby(part.splitlines(), lambda line: bool(ALIGNED.search(line))):
            lines = list(run)
            found.append("```text\n{}\n```".format("\n".join(lines)) if arranged else _escaped(" ".join(lines)))
    return "\n\n".join(one for one in found if one.strip())


def _table(title: str, rows: list[tuple[str, str]]) -> str:
    """Table of options and their help."""
    lines = "".join(f"| {_code(option)} | {_cell(about)} |\n" for option, about in rows)
    return f"| {title} | |\n| --- | --- |\n{lines}".rstrip()


def _code(option: str) -> str:
    return f"`{option}`".replace("|", r"\|")


def _cell(text: str) -> str:
    return _escaped(" ".join(text.split())).replace("|", r"\|")


def _escaped(text: str) -> str:
    """A plain text in Markdown."""
    return re.sub(r"([\\`*_\[\]<>])", r"\\\1", text).replace(r"\<", "&lt;").replace(r"\>", "&gt;")
