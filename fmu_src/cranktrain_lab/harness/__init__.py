"""System tests of coupled units: scenarios and assertions, as a file says them."""
