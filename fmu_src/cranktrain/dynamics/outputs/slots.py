"""Columns of the families in :class:`cranktrain.dynamics.outputs.register.Outputs`.

They are in a file of their own, so that kernels which call the families do not depend on the register.
"""

# ADDRESS: address of the kernel that fills the family's values.
# FIRST, END: index of the family's first value, and index after its last value.
# MEMBERS, WANTED: number of members of the family; 1 if its values are wanted.
ADDRESS, FIRST, END, MEMBERS, WANTED, COLUMNS = range(6)
