"""Design of a first engine file from a layout and a few sizes: standard practice, proportions, free forces."""
