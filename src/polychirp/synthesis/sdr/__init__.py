"""A model of a software-defined radio transceiver."""
