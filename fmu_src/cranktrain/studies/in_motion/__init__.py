"""Modes in motion as a report: lists of frequencies and the springs that stand for the films."""
