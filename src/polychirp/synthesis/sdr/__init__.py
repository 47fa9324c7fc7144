"""Software-defined radios: `transceiver` gives one radio's record of another's signal.

Others may use `transceived`, `arriving_power` and `link_for`.
"""
