"""Watch: which defect of an engine explains a change of its measured torsion."""
