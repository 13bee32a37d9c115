"""Makes the helpers beside this file importable from every folder; no example of hypothesis is timed.

A run ends with one line for each kind of skip, see :mod:`skips`.
"""

import gc

from hypothesis import HealthCheck, settings
from skips import KNOWN, kinds

settings.register_profile("any-machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any-machine")

FIRST = "fmu/test_slave.py", "regression/test_docs.py"
"""Files that compile the running model from empty caches: the FMU's own copy of it, and the package's."""


def pytest_collection_modifyitems(items):
    """Let two workers begin with these, one each: neither then compiles what the other is compiling too."""

    def place(item):
        path = item.path.as_posix()
        first = next((k for k, end in enumerate(FIRST) if path.endswith(end)), len(FIRST))
        return first, "/fmu/" in path

    items.sort(key=place)


def pytest_collection_finish():
    """Leave the objects made by collection out of garbage collection: they live to the end."""
    gc.freeze()


def pytest_addoption(parser):
    parser.addoption(
        "--known-skips", action="store_true", help="fail on a skip whose reason tests/skips.py does not list"
    )


def _skips(config):
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    reports = reporter.stats.get("skipped", []) if reporter else []
    return kinds(
        report.longrepr[2].removeprefix("Skipped: ") for report in reports if isinstance(report.longrepr, tuple)
    )


def pytest_sessionfinish(session, exitstatus):
    if session.config.getoption("--known-skips") and exitstatus == 0 and _skips(session.config)[1]:
        session.exitstatus = 1


def pytest_terminal_summary(terminalreporter, config):
    known, unknown = _skips(config)
    for start, count in known.items():
        terminalreporter.line(f"skipped {count}: {start} ({KNOWN[start]})")
    for reason, count in unknown.items():
        terminalreporter.line(f"skipped {count}: {reason} (not listed in tests/skips.py)", red=True)
