"""Columns of what fills the outputs, :class:`cranktrain.dynamics.outputs.register.Outputs`.

Apart from the register, so that the kernels which call the families do not rest on which families there are.
"""

from __future__ import annotations

# Kernel's address, first value and the one behind the last, members, whether anybody reads them.
ADDRESS, FIRST, END, MEMBERS, WANTED, COLUMNS = range(6)
