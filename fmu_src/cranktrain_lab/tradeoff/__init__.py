"""Study of accuracy against speed, with cost and error of each choice of method, level and resolution."""
