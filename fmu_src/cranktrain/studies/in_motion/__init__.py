"""Report on modes in motion: their frequencies, and the stand-in springs of the films."""
