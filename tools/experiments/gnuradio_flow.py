"""Program that applies GNU Radio's channel model to a SigMF recording, for GNU Radio's Python.

``python3 gnuradio_flow.py IN OUT NOISE OFFSET CLOCK SEED`` reads IN.sigmf-data (cf32_le) and writes
OUT.sigmf-data: noise voltage NOISE, frequency offset OFFSET relative to the sample rate, ratio
CLOCK of the sample clocks. It does not import polychirp, since GNU Radio is part of the operating
system's Python, which has other libraries.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any


def main(arguments: list[str]) -> int:
    """Run the flow graph to the end of the file."""
    source, sink, noise, offset, clock, seed = arguments
    gr: Any = import_module("gnuradio.gr")
    blocks: Any = import_module("gnuradio.blocks")
    channels: Any = import_module("gnuradio.channels")
    graph = gr.top_block()
    item = gr.sizeof_gr_complex
    channel = channels.channel_model(
        noise_voltage=float(noise),
        frequency_offset=float(offset),
        epsilon=float(clock),
        taps=[1.0 + 0.0j],
        noise_seed=int(seed),
    )
    out = blocks.file_sink(item, f"{sink}.sigmf-data")
    graph.connect(blocks.file_source(item, f"{source}.sigmf-data", False), channel, out)
    graph.run()
    out.close()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
