"""The correlation experiment of the paper's section V."""
