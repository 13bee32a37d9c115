"""Results for interactive use: short texts, tables for notebooks, data frames, pictures, conversion of units."""
