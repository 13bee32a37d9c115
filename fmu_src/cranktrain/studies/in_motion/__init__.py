"""Modes in motion as a report: lists of frequencies and the stand-in springs of the films."""
