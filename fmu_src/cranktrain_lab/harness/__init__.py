"""System tests of coupled units, with scenarios and assertions from a file."""
