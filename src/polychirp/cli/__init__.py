"""The command line: reads, calls, prints; computes no physics."""
