"""The command ``cranktrain``: one verb for each task, with a readable table or one JSON object as output.

Progress and errors go to stderr. A verb that ends early prints one line there, and with --json one object on stdout,
``{"error": {"what", "where", "remedy"}}``. Exit codes: 0 for success, 1 if an assertion of a harness fails, 2 for input
that cannot be used and computations that fail, 70 for faults of this program, 130 if interrupted, 143 if terminated.

Modules that take long to load are imported in functions, so that :func:`main` handles an interrupt in the first second.
"""

import argparse
import json
import os
import re
import shutil
import signal
import sys
import textwrap
import warnings
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from cranktrain.cli import streams
from cranktrain.cli.exit_codes import fault, interrupted, leave_stdout, one_line, parts, refused, terminable
from cranktrain.cli.verbs import FAMILIES, FORMER, FUNCTIONS, GROUPS, VERBS
from cranktrain.core.errors import CranktrainError, InputError, nearest
from cranktrain.core.user_file import user_path
from cranktrain.core.visible_text import visible_streams


class _Parser(argparse.ArgumentParser):
    """Parser whose errors are one line. ``asked`` is the verb's parser, once there is one."""

    asked: "_Parser | None" = None

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        # A moment of -1e-3 is a number, not an option.
        self._negative_number_matcher = re.compile(r"^-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.IGNORECASE)

    def error(self, message: str) -> NoReturn:
        own = self.asked or self
        text = re.sub(r"^argument (--[-0-9a-z]+): ", r"\1 ", message)
        if unknown := re.match(r"unrecognized arguments: ([^\s=]+)", text):
            word, verb = unknown[1], own.prog.removeprefix("cranktrain ")
            text = f"{verb}: '{word}' is one argument too many"
            if word.startswith("--"):
                shown = [name for one in own._actions if one.help != argparse.SUPPRESS for name in one.option_strings]
                hint = nearest(word[2:], [name[2:] for name in shown]).replace("'", "'--", 1)
                text = f"{verb}: there is no option '{word}'" + (f"; {hint}" if hint.startswith("did") else "")
        raise InputError(text if "; " in text else f"{text}; see {own.prog} --help")


FAILED, WRONG, FAULT = 1, 2, 70
"""Exit codes: assertion that fails, unusable input or failed computation, fault of this program."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code. Printed text contains no control characters."""
    with visible_streams():
        return _main(arguments)


def _main(arguments: Sequence[str] | None) -> int:
    given = sys.argv[1:] if arguments is None else list(arguments)
    # Its matrices are small: a second thread waits in a busy loop, which other processes and our own workers pay for.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    streams.prepare()
    stopped: list[signal.Signals] = []
    try:
        with terminable(stopped):
            return _run(given, stopped)
    except BrokenPipeError:
        leave_stdout()  # the reader, head or less, has seen enough
        return 0
    except CranktrainError as error:
        code, text = WRONG, str(error)
    except KeyboardInterrupt as stop:
        code, text = _interrupted_by(stopped), interrupted(stop)
    except MemoryError as error:
        code, text = (
            WRONG,
            f"the memory is not enough ({error or 'none is left'}); take a smaller model or fewer workers",
        )
    except Exception as error:
        known = refused(error) if isinstance(error, OSError) else ""
        code, text = (WRONG, known) if known else (FAULT, "")
        if stopped and code == FAULT:  # a library that is being loaded makes another error of an interrupt
            code, text = _interrupted_by(stopped), interrupted(KeyboardInterrupt())
        text = text or fault(error)
    text = one_line(text)
    print(f"cranktrain: {text}", file=sys.stderr, flush=True)
    if any(len(word) > 2 and "--json".startswith(word) for word in given):
        print(json.dumps({"error": parts(text)}, indent=2), flush=True)
    return code


def _interrupted_by(stopped: Sequence[signal.Signals]) -> int:
    """Exit code after a signal: 130 for an interrupt, 143 for a termination."""
    return 128 + (stopped[-1] if stopped else signal.SIGINT)


def _run(arguments: Sequence[str], stopped: Sequence[signal.Signals]) -> int:
    """Run the verb, and with --json print its result. Return the exit code."""
    options = with_homes(_parser(_verb(arguments)).parse_args(arguments))
    if options.plain:
        result = options.verb(options)
        if options.json:
            print(json.dumps(result, indent=2))
        return _ended(result, stopped)

    from cranktrain.cli.console import say
    from cranktrain.fmu.native.first_use import made_at_first_use
    from cranktrain.results.page_head import jsonable

    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_: say(f"cranktrain: warning: {one_line(str(message))}")
        with made_at_first_use():
            result = options.verb(options)
    if options.json:
        print(json.dumps(jsonable(result), indent=2, allow_nan=False))
    return _ended(result, stopped)


def _ended(result: dict[str, Any], stopped: Sequence[signal.Signals]) -> int:
    """Exit code of a verb that ended with a ``result``, or after a signal."""
    sys.stdout.flush()
    if result.get("interrupted"):
        return _interrupted_by(stopped)
    return FAILED if result.get("passed") is False else 0


def with_homes(options: argparse.Namespace) -> argparse.Namespace:
    """Options with ~ replaced by the home folder, because shells leave the text --mesh=~/crank.msh as it is."""
    for key, value in vars(options).items():
        if isinstance(value, str | Path) and str(value).startswith("~"):
            setattr(options, key, type(value)(user_path(value)))
        elif isinstance(value, list):
            homes = [str(user_path(one)) if isinstance(one, str) and one.startswith("~") else one for one in value]
            setattr(options, key, homes)
    return options


class _Version(argparse.Action):
    """Print the version, which is read only when needed."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        from cranktrain import __version__

        print(f"cranktrain {__version__}")
        parser.exit()


def _parser(*asked: str) -> _Parser:
    """Parser of all verbs. Only the requested verb gets its options, because the modules take time to load."""
    groups = (f"{title}:\n" + "\n".join(_rows(lines)) for title, lines in GROUPS.items())
    whole = _Parser(
        prog="cranktrain", usage="cranktrain [-h] [--version] VERB ...",
        epilog="\n\n".join((*groups, "cranktrain VERB --help tells all of a verb.")),
        description="Crankshaft dynamics of an engine.", formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    whole.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    verbs = whole.add_subparsers(
        metavar="VERB", required=True, parser_class=_Parser, help=argparse.SUPPRESS, prog="cranktrain"
    )
    kinds = {}
    for family in FAMILIES:
        text = "\n".join(_rows({name: line for name, line in VERBS.items() if name.startswith(f"{family} ")}))
        parser = verbs.add_parser(
            family, description=text, formatter_class=argparse.RawDescriptionHelpFormatter,
            usage=f"cranktrain {family} [-h] KIND ...",
        )  # fmt: skip
        kinds[family] = parser.add_subparsers(
            metavar="KIND", required=True, parser_class=_Parser, help=argparse.SUPPRESS, prog=f"cranktrain {family}"
        )
    for name in VERBS:
        family, _, kind = name.partition(" ")
        place = kinds[family] if kind else verbs
        if name in asked:
            whole.asked = _add_verb(place, name)
        else:
            place.add_parser(kind or name)
    return whole


def _rows(lines: dict[str, str]) -> Iterator[str]:
    """Names of verbs with their descriptions, wrapped to the width of the terminal."""
    width = max(60, shutil.get_terminal_size().columns - 2)
    for name, line in lines.items():
        yield textwrap.fill(line, width, initial_indent=f"  {name:<16}", subsequent_indent=" " * 18)


def _verb(arguments: Sequence[str]) -> str:
    """Requested verb, or an empty text; ``InputError`` for an unknown or renamed verb."""
    word, kind = [*arguments, "", ""][:2]
    if not word or word.startswith("-"):
        return ""
    if word in FAMILIES:
        if kind in FAMILIES[word]:
            return f"{word} {kind}"
        if kind in ("-h", "--help"):
            return ""
        said = f"there is no '{kind}'" if kind and not kind.startswith("-") else "its kind is missing"
        kinds = FAMILIES[word]
        raise InputError(
            f"{word}: {said}; give {', '.join(kinds[:-1])} or {kinds[-1]}, e.g. cranktrain {word} {kinds[0]}"
        )
    if word in FORMER:
        raise InputError(f"'{word}' is called '{FORMER[word]}' now; write cranktrain {FORMER[word]}")
    if word not in VERBS:
        names = [name.partition(" ")[0] for name in VERBS]
        raise InputError(f"there is no verb '{word}'; {nearest(word, list(dict.fromkeys(names)))}")
    return word


def _add_verb(place: Any, name: str) -> _Parser:
    """Add the parser of a verb whose options are the fields of a question, and return it."""
    from cranktrain.cli import parser
    from cranktrain.cli.functions import verb_of

    function = parser.function_of(FUNCTIONS[name])
    known, module = verb_of(function), sys.modules[function.__module__]
    sub: _Parser = place.add_parser(
        name.rpartition(" ")[2], description=known.about, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_question(sub, known)
    keys = (
        "; keys carry their unit (_hz, _um, …)" if known.subject is not None and known.subject.name == "engine" else ""
    )
    sub.add_argument("--json", action="store_true", help=f"print one JSON object{keys}")
    sub.set_defaults(verb=partial(parser.run_verb, module, function), plain=getattr(module, "PLAIN", False))
    return sub


if __name__ == "__main__":
    sys.exit(main())
