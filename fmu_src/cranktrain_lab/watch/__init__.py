"""Watch: detect changes of an engine's measured torsion and find the defect that explains them."""
