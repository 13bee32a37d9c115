"""Calibration: values of an engine file that meet published frequencies, within bounds that a designer accepts."""
