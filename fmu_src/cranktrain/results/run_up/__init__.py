"""Files, tables and pictures of run-ups."""
