"""Engines of layouts as ``new`` writes them, read back from their files without a warning."""

import warnings

from cranktrain.engine.file import load_engine
from cranktrain.studies.design.layouts import layout
from cranktrain.studies.design.rules import document
from cranktrain.studies.design.sizes import BARE, sizes


def designed(folder, name, bore=0.0825, stroke=0.0928, bank=None, equipment=BARE, **further):
    """Engine of a layout (bore and stroke, m), and its sizes; the file is ``name``.toml."""
    found = sizes(layout(name, bank), bore, stroke, **further)
    path = folder / f"{name}.toml"
    path.write_text(document(name, found, equipment).text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return load_engine(path), found
