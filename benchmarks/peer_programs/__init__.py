"""Other people's programs beside ours, one at a time: see ``benchmarks/peers.py``."""
