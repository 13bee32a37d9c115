"""A local page where knobs turn an engine's torsion: knobs, fast answers, full runs behind, the engine file after."""
