"""Runs at their start, and what they show by name."""

import numpy as np

from cranktrain.dynamics.simulation import Simulation


def at_speed(speed, *arguments, **more):
    """A run of :class:`Simulation` with these arguments, initialised at a speed, rad/s."""
    simulation = Simulation(*arguments, **more)
    simulation.inputs[0] = speed
    simulation.initialize()
    return simulation


def shown(simulation):
    """Present outputs by name."""
    return dict(zip(simulation.output_names, simulation.outputs.tolist(), strict=True))


def series(simulation, step, count):
    """Outputs (count,) by name over so many steps, s, from time 0."""
    rows = []
    for k in range(1, count + 1):
        simulation.step(k * step)
        rows.append(simulation.outputs.copy())
    return dict(zip(simulation.output_names, np.array(rows).T, strict=True))


def rate(values, step):
    """Derivative (n - 4,) of evenly spaced samples (n,), of fourth order, without two samples at each end."""
    return (8.0 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])) / (12.0 * step)
