"""A single-cylinder engine with the six's block cut down to it: it has every interface and few degrees of freedom."""

from dataclasses import replace
from functools import cache

from bodies import free_six


@cache
def single():
    """The engine; its block of a soft metal, to have modes below 1 kHz, meshes to some 45 000 degrees of freedom."""
    six = free_six()
    crankshaft = replace(six.crankshaft, throw_angles=(0.0,), main_widths=(0.04, 0.04), counterweights=(True, True))
    cylinders = replace(six.cylinders, firing_order=(1,), pins=(1,), bank_angles=(0.0,))
    mounts = replace(six.mounts, z=(0.02, 0.02, 0.11, 0.11), x=(-0.16, 0.16, -0.16, 0.16))
    return replace(
        six,
        name="single",
        crankshaft=crankshaft,
        cylinders=cylinders,
        thrust=replace(six.thrust, main=1),
        block=replace(six.block, pad_size=0.05, youngs_modulus=30e9, fixed_modes=160),
        mounts=mounts,
    )
