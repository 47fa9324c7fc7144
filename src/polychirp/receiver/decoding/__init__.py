"""The receiver of ramps that carry a code: it decodes a frame, which range-Doppler then reads.

* `chain`: `Decoding`, the receiver
* `reading`: `Reading`, a frame as its receiver reads it
* `code_limits`: frames that cannot be decoded, and why
* `correlation`: codes on a carrier of constant frequency, by correlation with the code
* `alignment`: codes on chirps, by alignment of their delays and multiplication by the code
"""
