"""What all else stands on: errors, jit decorator, cache folder, digests of sources, the one hand-off type."""
