"""What runs and models say: orders, summaries, tables, plots, result files."""
