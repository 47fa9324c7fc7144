"""Link budgets: who transmits to whom at which power, leakage, noise, inaudible radars."""
