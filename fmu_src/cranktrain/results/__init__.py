"""Evaluation of runs and models: orders, summaries, tables, plots, result files."""
