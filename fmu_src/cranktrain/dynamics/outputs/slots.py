"""Columns of the families in :class:`cranktrain.dynamics.outputs.register.Outputs`.

They are in a file of their own, so that kernels which call the families do not depend on the register.
"""

from __future__ import annotations

# Address of the kernel, first value and the one after the last, number of members, 1 if the values are wanted.
ADDRESS, FIRST, END, MEMBERS, WANTED, COLUMNS = range(6)
