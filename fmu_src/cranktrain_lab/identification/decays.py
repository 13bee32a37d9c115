"""Damping ratio of a measured free decay, from the samples of a channel over time."""

import math
from pathlib import Path

import numpy as np

from cranktrain.core.errors import InputError
from cranktrain.core.types import Array
from cranktrain.studies.run_up.free_decay import decaying_parts
from cranktrain_lab.measured.channels import TIME, Channel, decimated, of_array
from cranktrain_lab.measured.reading import read_measured

MOST_SAMPLES = 2000
"""Largest number of samples of a free decay that is analysed; a longer signal is thinned and cut."""
PER_CYCLE = 32.0
"""Least number of samples per period of the strongest oscillation after thinning."""
EXPLAINED = 0.2
"""Least fraction of a signal's energy in its largest decaying oscillation."""
FALL = 0.05
"""Least relative decrease of an oscillation over the recording, so that noise is not mistaken for decay."""
ROUNDED = 0.05
"""Relative difference of a time step from the mean step up to which it counts as rounding."""


def measured_damping_ratio(path: Path, name: str | None, where: str) -> float:
    """Return the damping ratio of a channel's largest decaying oscillation, from its largest sample on.

    Samples before the largest one, such as those before a trigger, are ignored. ``name`` is the channel; None for a
    file with one channel. Raises ``InputError`` for several channels without a name, uneven time steps, or no decay.
    """
    found = read_measured(path, channels=None if name is None else [name])
    if len(found.channels) != 1:
        raise InputError(f"{where}: name the channel of {path.name} that decays: {', '.join(found.names)}")
    channel = _even(found.channels[0], where)
    if not np.isfinite(channel.values()).all():
        raise InputError(f"{where}: channel {channel.name} of {path.name} has samples that are no numbers")
    signal, step = _from_the_largest(channel)
    if signal.size < 16 or not np.any(signal):
        raise InputError(f"{where}: channel {channel.name} of {path.name} holds no decaying oscillation")
    exponents, energies = decaying_parts(signal, step)
    hz = exponents.imag / (2.0 * math.pi)
    energies = np.where((hz > 1.0 / (signal.size * step)) & (exponents.real < 0.0), energies, 0.0)
    best = int(np.argmax(energies))
    # An oscillation has two conjugate exponents, hence the factor of two.
    part = 2.0 * float(energies[best]) / float(signal @ signal)
    if part < EXPLAINED:
        raise InputError(
            f"{where}: channel {channel.name} of {path.name} holds no decaying oscillation: the largest, of "
            f"{hz[best]:.4g} Hz, is {100.0 * part:.0f} % of its energy; cut the recording to the decay"
        )
    fall = -float(exponents[best].real) * signal.size * step
    if fall < FALL:
        raise InputError(
            f"{where}: channel {channel.name} of {path.name} does not decay: its largest oscillation, of "
            f"{hz[best]:.4g} Hz, falls by {100.0 * fall:.1g} % in {signal.size * step:.3g} s; record a longer decay"
        )
    return float(-exponents[best].real / abs(exponents[best]))


def _even(channel: Channel, where: str) -> Channel:
    """Return the channel with uniform time steps, corrected for rounding; ``InputError`` if they are not uniform."""
    if math.isfinite(channel.rate):
        return channel
    times = channel.abscissae() if channel.abscissa == TIME else np.zeros(1)
    step = float(times[-1] - times[0]) / max(times.size - 1, 1)
    if step <= 0.0 or np.max(np.abs(np.diff(times) - step)) > ROUNDED * step:
        raise InputError(
            f"{where}: channel {channel.name} of {channel.source} has no even steps of time; export it at even times"
        )
    return Channel(channel.name, channel.unit, channel.size, channel.source, channel.read, float(times[0]), step)


def _from_the_largest(channel: Channel) -> tuple[Array, float]:
    """Return samples (n,) from the largest on minus their mean, at most ``MOST_SAMPLES``, and their time step, s."""
    values = channel.values()
    values = values[int(np.argmax(np.abs(values - np.median(values)))) :]
    if values.size > MOST_SAMPLES:
        spectrum = np.abs(np.fft.rfft(values - values.mean()))
        strongest = max(int(np.argmax(spectrum)), 1) / (values.size * channel.step)
        rest = Channel("", "", values.size, "", of_array(values), 0.0, channel.step)
        _, step, thin = decimated(rest, max(PER_CYCLE * strongest, channel.rate * MOST_SAMPLES / values.size))
        # The filter lacks samples before the first sample, so the first samples of the filter's output are left out.
        values = thin[16 if step > channel.step else 0 :][:MOST_SAMPLES]
        return np.asarray(values - values.mean()), step
    return np.asarray(values - values.mean()), channel.step
