"""Files in and out: data sets, trials, samples, columns, markers, OpenSim, TOML."""
