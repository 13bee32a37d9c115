"""Watch of an engine: detect changes of the measured torsion, and find the defect that explains a change."""
