"""Structure-borne noise of an engine: velocity of the outer surfaces of its block, and the power that they radiate."""
