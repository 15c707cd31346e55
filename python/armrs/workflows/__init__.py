"""One module per verb: simulate, record, passive, identify, plan, history, gap, and others."""
