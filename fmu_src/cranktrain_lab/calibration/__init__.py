"""Calibration: values of an engine file that meet published frequencies, within bounds set by the user."""
