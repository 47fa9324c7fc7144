"""Software-defined radios that play and record at the same time.

`base` holds the interface and a measurement with it, `loopback` a radio without hardware, `soapy`
and `pluto` the adapters to hardware, and `bands` the services for which a transmission needs a
licence.
"""
