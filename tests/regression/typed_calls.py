"""Calls of the library that type checkers accept or refuse.

``mypy --strict``, which ``make lint`` runs on this file, finds each marked error and no other.
"""

import cranktrain as ct

run = ct.simulate("single_petrol", speed_rpm=4000, crank="rigid", bearings="held")
again = ct.simulate(ct.load_engine("single_petrol"), speed_rpm=4000.0, pressure=lambda angle: 1e5, load="balanced")
names: tuple[str, ...] = run.names
question = ct.Simulate(speed_rpm=4000, crank="torsional")

ct.simulate("single_petrol", speed_rpm=4000, crnk="rigid")  # type: ignore[call-arg]
ct.simulate("single_petrol", speed_rpm=4000, crank="rigd")  # type: ignore[arg-type]
ct.simulate("single_petrol", crank="rigid")  # type: ignore[call-arg]
ct.simulate(3, speed_rpm=4000)  # type: ignore[arg-type]
ct.Simulate(speed_rpm="fast")  # type: ignore[arg-type]
