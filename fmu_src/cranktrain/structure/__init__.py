"""From geometry to the reduced body; offline, never part of a running model."""
