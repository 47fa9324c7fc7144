"""Figures, tables and the HTML report: they show results and compute no physics."""
