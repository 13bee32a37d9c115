"""Results of a harness as JUnit XML, with one suite per scenario and one case per assertion."""

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from cranktrain.store.whole_file import marked
from cranktrain_lab.harness.judgement import Outcome
from cranktrain_lab.harness.running import Judged

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
