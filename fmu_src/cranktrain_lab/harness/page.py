"""Results of a harness as one HTML file, with assertions and their outputs over time, and as JUnit XML.

The XML has one suite per scenario and one case per assertion.
"""

import html
from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.reduced_body import Array
from cranktrain.results.tables import Table
from cranktrain.store.whole_file import marked
from cranktrain.studies.report.chart import bar_chart, line_chart
from cranktrain.studies.report.elements import paragraph, table
from cranktrain.studies.report.page import whole_page
from cranktrain_lab.coupling.modules import CRANKTRAIN
from cranktrain_lab.coupling.recording_unit import without_zero
from cranktrain_lab.coupling.run import Coupled
from cranktrain_lab.harness.entries import ORDER, Harness
from cranktrain_lab.harness.judgement import Outcome, order_amplitudes
from cranktrain_lab.harness.recording import MISFIT, UNIT
from cranktrain_lab.harness.running import Judged
from cranktrain_lab.harness.signals import SIGNALS

PAGE = marked("harness report of cranktrain", 'content="cranktrain harness"')
POINTS = 1200
"""Largest number of points of a curve."""
HIGHEST = 12.0
"""Highest order that is drawn."""


def page(harness: Harness, scenarios: Sequence[Judged]) -> str:
    """Return the HTML text of the page."""
    by_name = {one.scenario.name: one for one in scenarios}
    count = sum(one.passed for one in scenarios)
    rows = tuple(
        (
            one.scenario.name, "passed" if one.passed else "FAILED",
            f"{sum(o.passed for o in one.outcomes)} of {len(one.outcomes)}", f"{one.ran.seconds:.1f}",
            "" if one.result is None else one.result.name,
        )
        for one in scenarios
    )  # fmt: skip
    header = ("scenario", "verdict", "assertions passed", "seconds", "result file")
    body = "<section>" + table(Table(f"{count} of {len(scenarios)} scenarios passed", header, rows)) + "</section>"
    for k, one in enumerate(scenarios, 1):
        found = tuple(
            ("passed" if o.passed else "FAILED", o.name, o.quantity, o.expected, found_text(o)) for o in one.outcomes
        )
        parts = [table(Table("Assertions", ("verdict", "assertion", "quantity", "expected", "found"), found))]
        if one.ran.ended:
            parts.append(paragraph(f"The run ended: {one.ran.ended}"))
        parts += _charts(harness, one, by_name)
        name = html.escape(one.scenario.name)
        body += f'<section id="s{k}"><h2>{k}. {name}</h2>{"".join(parts)}</section>'
    contents = "".join(
        f'<li><a href="#s{k}">{html.escape(one.scenario.name)}</a></li>' for k, one in enumerate(scenarios, 1)
    )
    return whole_page("harness", f"{harness.title}: harness report", contents, body)


def _charts(harness: Harness, one: Judged, others: Mapping[str, Judged]) -> list[str]:
    """Return charts of asserted outputs and changed inputs over time, and of orders as bars."""
    run = one.ran.found
    if run is None or len(run.times) < 3:
        return []
    assertions = [assertion for assertion in one.scenario.assertions if assertion.output is not None]
    names = dict.fromkeys(name for name in run.names if name.startswith(f"{SIGNALS}."))
    names |= dict.fromkeys(".".join(assertion.output) for assertion in assertions if assertion.output is not None)
    compared = {".".join(a.output): a.ratio_to for a in assertions if a.output is not None and a.ratio_to in others}
    parts = []
    for name in names:
        other = others[compared[name]] if name in compared else None
        parts.append(_over_time(name, one, run, other))
    spectra = dict.fromkeys(".".join(a.output) for a in assertions if a.output is not None and a.measure == ORDER)
    for name in spectra:
        runs = {one.scenario.name: run}
        if name in compared and (found := others[compared[name]].ran.found) is not None:
            runs[compared[name]] = found
        parts += _orders(harness, name, runs)
    return parts


def _over_time(name: str, one: Judged, run: Coupled, other: Judged | None) -> str:
    unit = run.units[run.names.index(name)]
    every = max(1, -(-len(run.times) // POINTS))
    x = run.times[::every]
    curves: dict[str, Array] = {one.scenario.name: run.of(name)[::every]}
    if other is not None and other.ran.found is not None:
        found = other.ran.found
        curves[other.scenario.name] = np.interp(x, found.times, found.of(name), right=np.nan)
    if name.startswith(f"{MISFIT}."):
        output = name.removeprefix(f"{MISFIT}.")
        for word, source in (("model", CRANKTRAIN), ("measurement", UNIT)):
            angle, model = run.of(f"{CRANKTRAIN}.crank.angle"), run.of(f"{CRANKTRAIN}.{output}")
            own = without_zero(angle, model)
            curves[word] = (own if source == CRANKTRAIN else own - run.of(f"{MISFIT}.{output}"))[::every]
    label = f"{name.removeprefix(f'{SIGNALS}.')}{f' / {unit}' if unit else ''}"
    return line_chart(f"{label} over the time", x, curves, ("time / s", label))


def _orders(harness: Harness, name: str, runs: Mapping[str, Coupled]) -> list[str]:
    """Return a chart of an output's orders in one or two runs; none if a run has no whole cycle."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            bars = {key: order_amplitudes(harness, run, run.of(name), HIGHEST) for key, run in runs.items()}
    except InputError:
        return []
    unit = next(run.units[run.names.index(name)] for run in runs.values())
    orders = np.asarray(0.5 * np.arange(1, round(2.0 * HIGHEST) + 1))
    label = f"{name}, zero to peak{f' / {unit}' if unit else ''}"
    return [bar_chart(f"Orders of {name} over the last cycle", orders, bars, ("order", label))]


NAME = "cranktrain harness"
JUNIT = marked("JUnit file of cranktrain", NAME)


def junit(title: str, scenarios: Sequence[Judged]) -> bytes:
    """Return the content of the JUnit file."""
    root = Element("testsuites", name=f"{NAME}: {_plain(title)}")
    for one in scenarios:
        failed = sum(not outcome.passed for outcome in one.outcomes)
        error = int(_is_error(one))
        suite = SubElement(
            root, "testsuite", name=_plain(one.scenario.name), tests=str(len(one.outcomes)),
            failures=str(failed - error), errors=str(error), skipped="0", time=f"{one.ran.seconds:.3f}",
        )  # fmt: skip
        for k, outcome in enumerate(one.outcomes):
            _case(suite, one, outcome, first=k == 0)
        lines = [f"{'passed' if o.passed else 'FAILED'}  {o.quantity}: {found_text(o)}, expected {o.expected}"
                 for o in one.outcomes]  # fmt: skip
        SubElement(suite, "system-out").text = _plain("\n".join([*lines, f"result: {one.result or 'none'}"]))
    for key in ("tests", "failures", "errors"):
        root.set(key, str(sum(int(suite.get(key, "0")) for suite in root)))
    root.set("time", f"{sum(one.ran.seconds for one in scenarios):.3f}")
    indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, "utf-8") + b"\n"


def _is_error(one: Judged) -> bool:
    """True if a run ended with an error that was not expected."""
    return bool(one.ran.ended) and not one.outcomes[0].passed


def _case(suite: Element, one: Judged, outcome: Outcome, first: bool) -> None:
    seconds = one.ran.seconds if first else 0.0
    case = SubElement(
        suite, "testcase", name=_plain(outcome.name), classname=_plain(one.scenario.name), time=f"{seconds:.3f}"
    )
    if outcome.passed:
        return
    kind = "error" if first and _is_error(one) else "failure"
    said = f"expected {outcome.expected}, found {found_text(outcome)}"
    SubElement(case, kind, message=_plain(said), type=kind).text = _plain(f"{outcome.quantity}: {said}")


def found_text(outcome: Outcome) -> str:
    """Return the value that was found, as text."""
    found = outcome.found
    if found is None:
        return f"nothing: {outcome.remark}"
    text = f"{found:.6g} {outcome.unit}".rstrip() if isinstance(found, float) else found
    return f"{text} ({outcome.remark})" if outcome.remark else text


def _plain(text: str) -> str:
    """Return a text without characters that XML 1.0 does not allow."""
    return "".join(c for c in text if c in "\n\t" or ord(c) >= 32)
