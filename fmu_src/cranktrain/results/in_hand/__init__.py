"""Results as people use them: short texts, tables for notebooks, data frames, pictures, values in any unit."""
