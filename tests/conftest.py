"""Makes the helpers beside this file importable from every folder; examples of hypothesis are not timed.

They are the same in every run, so that a verdict can be had again; `make examples` looks for others.

A run ends with one line for each kind of skip, see :mod:`skips`.
"""

import gc

import pytest
from core import Phase, Recording, function_of, left_out, seconds_of_file
from hypothesis import HealthCheck, settings
from skips import KNOWN, kinds

settings.register_profile("any-machine", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("others", settings.get_profile("any-machine"), derandomize=False)
settings.load_profile("any-machine")

_phase = Phase()
FIRST = "fmu/test_slave.py", "regression/test_docs.py"
"""Files that compile the running model from empty caches: the FMU's own copy of it, and the package's."""


def pytest_collection_modifyitems(config, items):
    """Leave out what is not of the part; two workers begin with those files, one each, then with the longest ones."""
    part = config.getoption("--part")
    if part != "all":
        chosen, others = [], []
        for item in items:
            own = "rest" if function_of(item.nodeid) in left_out() else "core"
            (chosen if own == part else others).append(item)
        config.hook.pytest_deselected(items=others)
        items[:] = chosen

    def place(item):
        path = item.nodeid.partition("::")[0].removeprefix("tests/")
        return next((k for k, end in enumerate(FIRST) if path == end), len(FIRST)), -seconds_of_file(path), path

    items.sort(key=place)


def pytest_collection_finish():
    """Leave the objects made by collection out of garbage collection: they live to the end."""
    gc.freeze()


def pytest_addoption(parser):
    parser.addoption(
        "--known-skips", action="store_true", help="fail on a skip whose reason tests/skips.py does not list"
    )
    parser.addoption(
        "--part",
        choices=("core", "rest", "all"),
        default="all",
        help="the core that tests/core.py chose, all else, or both",
    )
    parser.addoption("--durations-to", metavar="FILE", help="write what each function took, for tests/core.py")


def pytest_configure(config):
    path = config.getoption("--durations-to")
    if path and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Recording(path))


def pytest_runtest_logstart():
    _phase.begin()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport():
    report = yield
    report.processor = _phase.end()  # of setup, call or teardown
    return report


def _skips(config):
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    reports = reporter.stats.get("skipped", []) if reporter else []
    return kinds(
        report.longrepr[2].removeprefix("Skipped: ") for report in reports if isinstance(report.longrepr, tuple)
    )


def pytest_sessionfinish(session, exitstatus):
    if session.config.getoption("--known-skips") and exitstatus == 0 and _skips(session.config)[1]:
        session.exitstatus = 1
    if session.config.getoption("--part") == "rest" and exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:
        session.exitstatus = 0  # of files all of which are core


def pytest_terminal_summary(terminalreporter, config):
    known, unknown = _skips(config)
    for start, count in known.items():
        terminalreporter.line(f"skipped {count}: {start} ({KNOWN[start]})")
    for reason, count in unknown.items():
        terminalreporter.line(f"skipped {count}: {reason} (not listed in tests/skips.py)", red=True)
