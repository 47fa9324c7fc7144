"""One pure function per figure: data in, a drawing with the table of its data out."""
