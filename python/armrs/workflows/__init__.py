"""What a user does, a module a verb: simulate, record, passive, identify, plan, history, demo, gap."""
