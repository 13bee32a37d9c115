"""Run-ups: steady cycles at many speeds, each started from those at its neighbours, side by side."""
