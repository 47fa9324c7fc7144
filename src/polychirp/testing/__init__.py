"""What tests of polychirp and of its plug-ins share."""
