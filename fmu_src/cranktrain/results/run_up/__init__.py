"""Run-ups: their file, tables, pictures."""
