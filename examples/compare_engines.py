"""Numerical differences of run-ups of all shipped engines: usual step against a fine one, and another integrator.

python examples/compare_engines.py [ENGINE ...]

The table lists the largest differences of the pulley's orders and resonances, by ``ct.compare``.
"""

import sys
from collections.abc import Iterator

import cranktrain as ct
from cranktrain.core.units import RPM

QUANTITIES = ("order", "peak-speed", "peak-height", "damping")
USUAL, FINE = {"crank": "torsional"}, {"crank": "torsional", "step_deg": 2.0}
OTHER = {"crank": "torsional", "integrator": "sdirk4", "step_deg": 2.0}


def run_up(name: str, levels):
    """Orders of an engine from half its highest speed on, at 25 speeds."""
    last = ct.load_engine(name).speeds[1] / RPM
    return ct.runup(name, from_rpm=0.5 * last, to_rpm=last, step_rpm=last / 48.0, workers=1, **levels)


def largest(found) -> list[float]:
    """Largest difference of each quantity, in per cent; nan without a resonance."""
    rows = found["differences"]
    return [
        max((100.0 * abs(one["difference"]) for one in rows if one["quantity"] == name), default=float("nan"))
        for name in QUANTITIES
    ]


def differences(names) -> Iterator[tuple[str, list[float]]]:
    """Differences of the usual step from a fine one, and of another integrator from the usual one at that step."""
    for name in names:
        usual, fine, other = (run_up(name, levels) for levels in (USUAL, FINE, OTHER))
        yield name, largest(ct.compare(fine, usual)) + largest(ct.compare(fine, other))


def main() -> int:
    """Print the table."""
    print("| engine |", " | ".join(QUANTITIES * 2), "|")
    for name, values in differences(sys.argv[1:] or ct.engines()):
        print(f"| {name} |", " | ".join(f"{value:.2g}" for value in values), "|", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
