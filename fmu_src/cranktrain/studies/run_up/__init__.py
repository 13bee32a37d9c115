"""Run-ups: steady cycles at many speeds, computed in parallel and each started from a neighbouring speed."""
