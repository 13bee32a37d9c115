"""Makes the bodies in ``tests/solids.py`` importable from every folder; no example of hypothesis is timed."""

from hypothesis import HealthCheck, settings

settings.register_profile("any-machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any-machine")
