"""Reading and writing of files: data sets, trials, samples, markers, OpenSim, TOML."""
