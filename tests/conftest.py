"""Makes the bodies in ``tests/solids.py`` importable from every folder of tests."""
