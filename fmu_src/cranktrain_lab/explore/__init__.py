"""Local web page for exploring an engine's torsion with sliders (knobs), linear results, full runs and engine files."""
