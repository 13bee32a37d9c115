"""Makes the helpers beside this file importable from every folder; no example of hypothesis is timed."""

from hypothesis import HealthCheck, settings

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
